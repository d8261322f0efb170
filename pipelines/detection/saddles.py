"""Places where two edges may cross: saddles of the grey values with four alternating sectors around them.

A saddle's strength is compared with the contrast around it, so that a dim board counts as much as a bright one.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.sampling import Level, sample

SMOOTHING_PX = 1.5  # of the picture before its second derivatives are taken
AROUND_PX = 5  # half side of the square that tells the contrast around a place
LEAST_STRENGTH = 0.03  # of the saddle over the variance around it; 4 / pi^2 where sharp edges cross at right angles
FLAT_GREY, FLAT_NOISES = 1.0, 4.0  # spread of what counts as flat: grey levels, and standard deviations of the noise
NOISE_STRIDE = 7  # every so many pixels tell the noise
MOST_SADDLES = 3000  # the strongest; bounds the work that noise and textures make
RING_PX, RING_SAMPLES = 3.5, 32
LEAST_SWING = 6.0  # noises between the ring's brightest and darkest sample
OPPOSITE_RAD = 0.7  # how far an edge may bend at the saddle, as seen from the ring


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
    rows, columns = _peaks(smoothed, xy * xy - xx * yy, noise)
    points = np.stack((columns, rows), axis=1) + _offsets(smoothed, rows, columns, xx, yy, xy)
    return _with_four_sectors(smoothed, points, noise)


def _second(smoothed: Level, dx: int, dy: int) -> Level:
    return np.asarray(cv2.Sobel(smoothed, cv2.CV_32F, dx, dy, ksize=3, scale=0.25), np.float32)


def _noise(second: Level) -> float:
    """Standard deviation of the smoothed level's noise, from a second derivative, most of which is noise alone."""
    median = float(np.median(np.abs(second[::NOISE_STRIDE, ::NOISE_STRIDE])))
    return median / 0.6745 * SMOOTHING_PX**2 / np.sqrt(3.0)  # white noise, smoothed: its derivative is so much smaller


def _peaks(smoothed: Level, strength: Array, noise: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Rows and columns of the strongest local maxima of the saddle's strength."""
    flat = (FLAT_GREY + FLAT_NOISES * noise) ** 2
    peak = strength > LEAST_STRENGTH * flat / SMOOTHING_PX**4
    peak &= strength >= cv2.dilate(strength, np.ones((5, 5), np.uint8))
    margin = int(np.ceil(RING_PX)) + 1
    peak[:margin], peak[-margin:], peak[:, :margin], peak[:, -margin:] = False, False, False, False
    rows, columns = np.nonzero(peak)
    size = (2 * AROUND_PX + 1, 2 * AROUND_PX + 1)
    squares, means = cv2.sqrBoxFilter(smoothed, cv2.CV_32F, size), cv2.boxFilter(smoothed, cv2.CV_32F, size)
    variance = np.maximum(squares[rows, columns] - means[rows, columns] ** 2, 0.0)
    ratio = strength[rows, columns] * SMOOTHING_PX**4 / (variance + flat)
    use = np.flatnonzero(ratio > LEAST_STRENGTH)
    rows, columns, ratio = rows[use], columns[use], ratio[use]
    order = np.argsort(-ratio, kind="stable")[:MOST_SADDLES]
    return rows[order], columns[order]


def _offsets(
    smoothed: Level, rows: NDArray[np.intp], columns: NDArray[np.intp], xx: Level, yy: Level, xy: Level
) -> Array:
    """(n, 2) from pixels to the saddles of the parabolas through them, at most a pixel."""
    dx = 0.5 * (smoothed[rows, columns + 1].astype(np.float64) - smoothed[rows, columns - 1])
    dy = 0.5 * (smoothed[rows + 1, columns].astype(np.float64) - smoothed[rows - 1, columns])
    a, b, c = (second[rows, columns].astype(np.float64) for second in (xx, yy, xy))
    determinant = a * b - c * c
    steps = np.stack((c * dy - b * dx, c * dx - a * dy), axis=1) / determinant[:, None]
    return np.clip(steps, -1.0, 1.0)


def _with_four_sectors(smoothed: Level, points: Array, noise: float) -> Saddles:
    """Those around which a ring crosses the mean of its extremes four times, at two nearly straight lines."""
    turn = np.arange(RING_SAMPLES) * (2.0 * np.pi / RING_SAMPLES)
    ring = sample(smoothed, points[:, None] + RING_PX * np.stack((np.cos(turn), np.sin(turn)), axis=1))
    low, high = ring.min(axis=1), ring.max(axis=1)
    level = ring - 0.5 * (low + high)[:, None]
    following = np.roll(level, -1, axis=1)
    crossing = (level < 0.0) != (following < 0.0)
    use = (crossing.sum(axis=1) == 4) & (high - low > LEAST_SWING * noise + FLAT_GREY)
    points, level, following, swing = points[use], level[use], following[use], (high - low)[use]
    which = np.nonzero(crossing[use])[1].reshape(-1, 4)
    before, after = np.take_along_axis(level, which, 1), np.take_along_axis(following, which, 1)
    angles = (which + before / (before - after)) * (2.0 * np.pi / RING_SAMPLES)
    straight = np.all(np.abs(angles[:, 2:] - angles[:, :2] - np.pi) < OPPOSITE_RAD, axis=1)
    return Saddles(points[straight], angles[straight], (before[:, 0] < 0.0)[straight], swing[straight])
