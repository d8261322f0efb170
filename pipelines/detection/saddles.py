"""Places where two edges may cross: saddles of the grey values with four alternating sectors around them.

A saddle's strength is compared with the contrast around it, so that a dim board counts as much as a bright one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.kernels import compiled, compiled_part, inlined
from pipelines.detection.sampling import Level, grey_at

SMOOTHING_PX = 1.5  # of the picture before its second derivatives are taken
AROUND_PX = 5  # half side of the square that tells the contrast around a place
LEAST_STRENGTH = 0.03  # of the saddle over the variance around it; 4 / pi^2 where sharp edges cross at right angles
FLAT_GREY, FLAT_NOISES = 1.0, 4.0  # spread of what counts as flat: grey levels, and standard deviations of the noise
NOISE_STRIDE = 7  # every so many pixels tell the noise
MOST_SADDLES = 3000  # the strongest; bounds the work that noise and textures make
RING_PX, RING_SAMPLES = 3.5, 32
TURN = np.arange(RING_SAMPLES) * (2.0 * np.pi / RING_SAMPLES)
RING = np.stack((np.cos(TURN), np.sin(TURN)), axis=1)
APART_PX = 2  # of a saddle from a stronger one, at least
LEAST_AREA = (APART_PX + 1) ** 2  # px to a saddle: no two are nearer
MARGIN_PX = max(AROUND_PX, math.ceil(RING_PX) + 1)  # from the level's border in which none is looked for
LEAST_SWING = 6.0  # noises between the ring's brightest and darkest sample
OPPOSITE_RAD = 0.7  # how far an edge may bend at the saddle, as seen from the ring


Places = NDArray[np.int64]  # (n,) rows or columns


class Saddles(NamedTuple):
    """n saddles, the strongest first."""

    points: Array  # (n, 2) px of the level
    angles: Array  # (n, 4) rising directions of the four edges that leave the saddle, rad, from x towards y
    brightens: Mask  # (n,) whether grey values rise across the first edge with rising angle; they do at each other edge
    swing: Array  # (n,) grey levels between the brightest and the darkest sector


def smooth(level: Level) -> Level:
    """The level as saddles are looked for in it."""
    return np.asarray(cv2.GaussianBlur(level, (0, 0), SMOOTHING_PX), np.float32)


def find_saddles(smoothed: Level) -> Saddles:
    """Saddles of a smoothed level that have four alternating sectors."""
    if min(smoothed.shape) <= 2 * AROUND_PX:
        return Saddles(np.empty((0, 2)), np.empty((0, 4)), np.empty(0, bool), np.empty(0))
    xx, yy, xy = (_second(smoothed, *order) for order in ((2, 0), (0, 2), (1, 1)))
    noise = _noise(xx)
    rows, columns = _peaks(smoothed, xx, yy, xy, noise)
    points = np.stack((columns, rows), axis=1) + _offsets(smoothed, rows, columns, xx, yy, xy)
    return _with_four_sectors(smoothed, points, noise)


def _second(smoothed: Level, dx: int, dy: int) -> Level:
    return np.asarray(cv2.Sobel(smoothed, cv2.CV_32F, dx, dy, ksize=3, scale=0.25), np.float32)


def _noise(second: Level) -> float:
    """Standard deviation of the smoothed level's noise, from a second derivative, most of which is noise alone."""
    median = float(np.median(np.abs(second[::NOISE_STRIDE, ::NOISE_STRIDE])))
    return median / 0.6745 * SMOOTHING_PX**2 / np.sqrt(3.0)  # white noise, smoothed: its derivative is so much smaller


def _peaks(smoothed: Level, xx: Level, yy: Level, xy: Level, noise: float) -> tuple[Places, Places]:
    """Rows and columns of the strongest local maxima of the saddle's strength."""
    rows, columns = np.empty(smoothed.size // LEAST_AREA, np.int64), np.empty(smoothed.size // LEAST_AREA, np.int64)
    ratio = np.empty(len(rows))
    flat = (FLAT_GREY + FLAT_NOISES * noise) ** 2
    count = _find_peaks(smoothed, xx, yy, xy, flat, rows, columns, ratio)
    order = np.argsort(-ratio[:count], kind="stable")[:MOST_SADDLES]
    return rows[order], columns[order]


@inlined
def _strength(xx: Level, yy: Level, xy: Level, row: int, column: int) -> float:
    """Of a saddle: minus the determinant of the second derivatives."""
    mixed = xy[row, column]
    return mixed * mixed - xx[row, column] * yy[row, column]


@compiled_part
def _is_peak(xx: Level, yy: Level, xy: Level, row: int, column: int, strength: float) -> bool:
    """Whether nothing up to two pixels away is stronger."""
    for y in range(row - APART_PX, row + APART_PX + 1):
        for x in range(column - APART_PX, column + APART_PX + 1):
            if _strength(xx, yy, xy, y, x) > strength:
                return False
    return True


@compiled_part
def _variance(smoothed: Level, row: int, column: int) -> float:
    """Of the grey values in the square around a place."""
    total, square, count = 0.0, 0.0, 0
    middle = smoothed[row, column]
    for y in range(row - AROUND_PX, row + AROUND_PX + 1):
        for x in range(column - AROUND_PX, column + AROUND_PX + 1):
            grey = float(smoothed[y, x] - middle)
            total += grey
            square += grey * grey
            count += 1
    return square / count - (total / count) ** 2


@compiled
def _find_peaks(
    smoothed: Level, xx: Level, yy: Level, xy: Level, flat: float, rows: Places, columns: Places, ratio: Array
) -> int:
    """Maxima of the strength, row by row, and their strengths over the variance around them; returns their number."""
    height, width = smoothed.shape
    least, count = LEAST_STRENGTH * flat / SMOOTHING_PX**4, 0
    strengths = np.empty(width, np.float32)
    for row in range(MARGIN_PX, height - MARGIN_PX):
        for column in range(width):  # a loop without branches works on several numbers at once
            strengths[column] = _strength(xx, yy, xy, row, column)
        for column in range(MARGIN_PX, width - MARGIN_PX):
            strength = strengths[column]
            if strength > least and count < len(rows) and _is_peak(xx, yy, xy, row, column, strength):
                share = strength * SMOOTHING_PX**4 / (_variance(smoothed, row, column) + flat)
                if share > LEAST_STRENGTH:
                    rows[count], columns[count], ratio[count] = row, column, share
                    count += 1
    return count


def _offsets(smoothed: Level, rows: Places, columns: Places, xx: Level, yy: Level, xy: Level) -> Array:
    """(n, 2) from pixels to the saddles of the parabolas through them, at most a pixel."""
    dx = 0.5 * (smoothed[rows, columns + 1].astype(np.float64) - smoothed[rows, columns - 1])
    dy = 0.5 * (smoothed[rows + 1, columns].astype(np.float64) - smoothed[rows - 1, columns])
    a, b, c = (second[rows, columns].astype(np.float64) for second in (xx, yy, xy))
    determinant = a * b - c * c
    steps = np.stack((c * dy - b * dx, c * dx - a * dy), axis=1) / determinant[:, None]
    return np.clip(steps, -1.0, 1.0)


def _with_four_sectors(smoothed: Level, points: Array, noise: float) -> Saddles:
    """Those around which a ring crosses the mean of its extremes four times, at two nearly straight lines."""
    n = len(points)
    angles, brightens, swing = np.empty((n, 4)), np.empty(n, bool), np.empty(n)
    _look_around(smoothed, points, RING_PX * RING, np.empty(RING_SAMPLES), angles, brightens, swing)
    straight = swing > LEAST_SWING * noise + FLAT_GREY
    return Saddles(points[straight], angles[straight], brightens[straight], swing[straight])


@compiled
def _look_around(
    smoothed: Level, points: Array, ring: Array, grey: Array, angles: Array, brightens: Mask, swing: Array
) -> None:
    """Fill in what the ring (m, 2) px around each place shows; the swing is 0 where it shows no four sectors.

    grey: (m,) workspace.
    """
    for i in range(len(points)):
        low, high = np.inf, -np.inf
        for k in range(len(ring)):
            grey[k] = grey_at(smoothed, points[i, 0] + ring[k, 0], points[i, 1] + ring[k, 1])
            low, high = min(low, grey[k]), max(high, grey[k])
        swing[i] = high - low if _find_sectors(grey, 0.5 * (low + high), angles[i]) else 0.0
        brightens[i] = grey[0] < 0.5 * (low + high)  # so are all up to the first crossing


@compiled_part
def _find_sectors(grey: Array, middle: float, angles: Array) -> bool:
    """Fill in where a ring of grey values crosses the middle, rad; whether it does four times, at two lines."""
    count, samples = 0, len(grey)
    for k in range(samples):
        here, following = grey[k] - middle, grey[(k + 1) % samples] - middle
        if (here < 0.0) != (following < 0.0):
            if count < 4:
                angles[count] = (k + here / (here - following)) * (2.0 * math.pi / samples)
            count += 1
    if count != 4:
        return False
    one, other = abs(angles[2] - angles[0] - math.pi), abs(angles[3] - angles[1] - math.pi)
    return one < OPPOSITE_RAD and other < OPPOSITE_RAD


def prepare() -> None:
    """Call each compiled function once."""
    size = 2 * MARGIN_PX + 1
    find_saddles(np.zeros((size, size), np.float32))
