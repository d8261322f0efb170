"""Grey values between pixels, bilinear; NaN outside of the pixels' centres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.kernels import compiled, inlined

Level = NDArray[np.float32]  # (height, width) grey values of the picture, reduced or enlarged


def sample(level: Level, points: Array) -> Array:
    """(..., ) grey values at (..., 2) px; NaN outside."""
    out = np.empty(points.shape[:-1])
    _sample_all(level, np.ascontiguousarray(points, np.float64).reshape(-1, 2), out.ravel())
    return out


@inlined
def grey_at(level: Level, x: float, y: float) -> float:
    """Grey value at one place, px."""
    height, width = level.shape
    value = np.nan
    if 0.0 <= x < width - 1 and 0.0 <= y < height - 1:  # false for NaN
        column, row = int(x), int(y)
        right, down = x - column, y - row
        above = (1.0 - right) * level[row, column] + right * level[row, column + 1]
        below = (1.0 - right) * level[row + 1, column] + right * level[row + 1, column + 1]
        value = (1.0 - down) * above + down * below
    return value


@compiled
def _sample_all(level: Level, points: Array, out: Array) -> None:
    for i in range(len(points)):
        out[i] = grey_at(level, points[i, 0], points[i, 1])


def prepare() -> None:
    """Call the compiled function once."""
    sample(np.zeros((2, 2), np.float32), np.zeros((1, 2)))
