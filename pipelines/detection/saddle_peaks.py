"""The strongest saddles of a level's grey values: where they are, and how strong they are for the contrast around them.

A loop along a row without branches works on several pixels at once.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.kernels import compiled, compiled_part, inlined
from pipelines.detection.sampling import Level

SMOOTHING_PX = 1.5  # of the picture before its second derivatives are taken
AROUND_PX = 5  # half side of the square that tells the contrast around a place, which lies so far from the border
LEAST_STRENGTH = 0.03  # of the saddle over the variance around it; 4 / pi^2 where sharp edges cross at right angles
FLAT_GREY, FLAT_NOISES = 1.0, 4.0  # spread of what counts as flat: grey levels, and standard deviations of the noise
NOISE_STRIDE = 7  # every so many pixels tell the noise
MOST_SADDLES = 3000  # the strongest; bounds the work that noise and textures make
APART_PX = 2  # of a saddle from a stronger one, at least
LEAST_AREA = (APART_PX + 1) ** 2  # px to a saddle: no two are nearer
QUARTER = np.float32(0.25)

Places = NDArray[np.int64]  # (n,) rows or columns


def noise_of(smoothed: Level) -> float:
    """Standard deviation of the smoothed level's noise, from a second derivative, most of which is noise alone."""
    second = np.empty([math.ceil(size / NOISE_STRIDE) for size in smoothed.shape])
    _sample_second(smoothed, second)
    median = float(np.median(second))
    return median / 0.6745 * SMOOTHING_PX**2 / np.sqrt(3.0)  # white noise, smoothed: its derivative is so much smaller


def strongest_saddles(smoothed: Level, noise: float) -> Array:
    """(n, 2) px of the strongest local maxima of the saddle's strength, the strongest first."""
    strengths = np.empty_like(smoothed)
    _fill_strengths(smoothed, strengths)
    rows, columns = np.empty(smoothed.size // LEAST_AREA, np.int64), np.empty(smoothed.size // LEAST_AREA, np.int64)
    ratio = np.empty(len(rows))
    flat = (FLAT_GREY + FLAT_NOISES * noise) ** 2
    count = _find_peaks(smoothed, strengths, flat, rows, columns, ratio)
    order = np.argsort(-ratio[:count], kind="stable")[:MOST_SADDLES]
    points = np.empty((len(order), 2))
    _place(smoothed, rows[order], columns[order], points)
    return points


@inlined
def _second(
    a: float, b: float, c: float, d: float, e: float, f: float, g: float, h: float, i: float
) -> tuple[float, float, float]:
    """Second derivatives along x, along y and mixed, smoothed, of nine grey values row by row; four times as large."""
    xx = ((d + f) - (e + e)) + ((d + f) - (e + e)) + (((a + c) - (b + b)) + ((g + i) - (h + h)))
    yy = (((a + c) + (b + b)) + ((g + i) + (h + h))) - (((d + f) + (e + e)) + ((d + f) + (e + e)))
    return xx, yy, (i - g) - (c - a)


@compiled_part
def _derivatives(smoothed: Level, row: int, column: int) -> tuple[float, float, float]:
    """Second derivatives along x, along y and mixed at one pixel; beyond the border the level is its mirror image."""
    height, width = smoothed.shape
    above, below = abs(row - 1), row + 1 if row + 1 < height else height - 2
    left, right = abs(column - 1), column + 1 if column + 1 < width else width - 2
    xx, yy, xy = _second(
        smoothed[above, left], smoothed[above, column], smoothed[above, right],
        smoothed[row, left], smoothed[row, column], smoothed[row, right],
        smoothed[below, left], smoothed[below, column], smoothed[below, right],
    )  # fmt: skip
    return 0.25 * xx, 0.25 * yy, 0.25 * xy


@compiled
def _sample_second(smoothed: Level, out: Array) -> None:
    """Second derivatives along x, without their sign, of every so many pixels."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = abs(_derivatives(smoothed, NOISE_STRIDE * i, NOISE_STRIDE * j)[0])


@compiled
def _fill_strengths(smoothed: Level, out: Level) -> None:
    """Strength of a saddle at each pixel but those at the border: minus the determinant of the second derivatives."""
    height, width = smoothed.shape
    for row in range(1, height - 1):
        above, here, below, strengths = smoothed[row - 1], smoothed[row], smoothed[row + 1], out[row]
        for k in range(width - 2):
            xx, yy, xy = _second(
                above[k], above[k + 1], above[k + 2],
                here[k], here[k + 1], here[k + 2],
                below[k], below[k + 1], below[k + 2],
            )  # fmt: skip
            strengths[k + 1] = QUARTER * xy * (QUARTER * xy) - QUARTER * xx * (QUARTER * yy)


@compiled_part
def _is_peak(strengths: Level, row: int, column: int) -> bool:
    """Whether nothing up to two pixels away is stronger; the nearest are looked at first, as most pixels end there."""
    own = strengths[row, column]
    beside = max(strengths[row, column - 1], strengths[row, column + 1])
    if max(beside, strengths[row - 1, column], strengths[row + 1, column]) > own:
        return False
    for y in range(row - APART_PX, row + APART_PX + 1):
        for x in range(column - APART_PX, column + APART_PX + 1):
            if strengths[y, x] > own:
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
def _find_peaks(smoothed: Level, strengths: Level, flat: float, rows: Places, columns: Places, ratio: Array) -> int:
    """Maxima of the strength, row by row, and their strengths over the variance around them; returns their number."""
    height, width = smoothed.shape
    least, count = np.float32(LEAST_STRENGTH * flat / SMOOTHING_PX**4), 0
    for row in range(AROUND_PX, height - AROUND_PX):
        line = strengths[row]
        for column in range(AROUND_PX, width - AROUND_PX):
            if line[column] > least and count < len(rows) and _is_peak(strengths, row, column):
                share = line[column] * SMOOTHING_PX**4 / (_variance(smoothed, row, column) + flat)
                if share > LEAST_STRENGTH:
                    rows[count], columns[count], ratio[count] = row, column, share
                    count += 1
    return count


@compiled
def _place(smoothed: Level, rows: Places, columns: Places, points: Array) -> None:
    """Fill in (n, 2) px of the saddles of the parabolas through pixels, at most a pixel away from these."""
    for i in range(len(rows)):
        row, column = rows[i], columns[i]
        dx = 0.5 * (float(smoothed[row, column + 1]) - float(smoothed[row, column - 1]))
        dy = 0.5 * (float(smoothed[row + 1, column]) - float(smoothed[row - 1, column]))
        xx, yy, xy = _derivatives(smoothed, row, column)
        determinant = xx * yy - xy * xy
        points[i, 0] = column + min(max((xy * dy - yy * dx) / determinant, -1.0), 1.0)
        points[i, 1] = row + min(max((xy * dx - xx * dy) / determinant, -1.0), 1.0)


def prepare() -> None:
    """Call each compiled function once."""
    level = np.zeros((2 * AROUND_PX + 1, 2 * AROUND_PX + 1), np.float32)
    strongest_saddles(level, noise_of(level))
