"""What the known points of a lattice say of the others: where they are, and how long squares are around them."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.detection.kernels import compiled, compiled_part

STEPS = ((1, 0), (0, 1), (-1, 0), (0, -1))  # from a point to its neighbours: columns, rows
MOST_GUESSES = 12


def predicted(points: Array) -> Array:
    """(rows, columns, 2) px where each point would be by those near it, NaN where too few are: lines go on straight,
    and squares are parallelograms."""
    out = np.empty(points.shape)
    _predict(points, np.empty(MOST_GUESSES), out)
    return out


def axes(points: Array) -> tuple[Array, Array]:
    """(rows, columns, 2) px along x and along y of the squares around each point, NaN where none is known."""
    along_x, along_y = np.empty(points.shape), np.empty(points.shape)
    _steps(points, 1, 0, np.empty(MOST_GUESSES), along_x)
    _steps(points, 0, 1, np.empty(MOST_GUESSES), along_y)
    return along_x, along_y


@compiled_part
def _insert(value: float, rising: Array, count: int) -> int:
    """Put a value among the first `count`, which rise; their new number. A value that is not known is left out."""
    if np.isnan(value):
        return count
    place = count
    while place > 0 and rising[place - 1] > value:
        rising[place] = rising[place - 1]
        place -= 1
    rising[place] = value
    return count + 1


@compiled_part
def _median(rising: Array, count: int) -> float:
    """Of the first `count`, which rise; NaN of none."""
    return 0.5 * (rising[(count - 1) // 2] + rising[count // 2]) if count > 0 else np.nan


@compiled_part
def _at(points: Array, row: int, column: int, k: int) -> float:
    """Number k of a point; NaN beyond the lattice."""
    rows, columns, _ = points.shape
    inside = 0 <= row < rows and 0 <= column < columns
    return points[row, column, k] if inside else np.nan


@compiled
def _predict(points: Array, rising: Array, out: Array) -> None:
    rows, columns, _ = points.shape
    for row in range(rows):
        for column in range(columns):
            for k in range(2):
                count = 0
                for x, y in STEPS:
                    near, far = _at(points, row + y, column + x, k), _at(points, row + 2 * y, column + 2 * x, k)
                    count = _insert(2.0 * near - far, rising, count)
                    beside = _at(points, row + x, column - y, k)  # a quarter of a turn on
                    across = _at(points, row + y + x, column + x - y, k)
                    count = _insert(near + beside - across, rising, count)
                out[row, column, k] = _median(rising, count)


@compiled
def _steps(points: Array, ahead: int, down: int, rising: Array, out: Array) -> None:
    """Median of the steps around each point: those that begin up to one place off, or two places before it."""
    rows, columns, _ = points.shape
    for row in range(rows):
        for column in range(columns):
            for k in range(2):
                count = 0
                for along in range(-2, 2):
                    for aside in range(-1, 2):
                        r, c = row + along * down + aside * ahead, column + along * ahead + aside * down
                        step = _at(points, r + down, c + ahead, k) - _at(points, r, c, k)
                        count = _insert(step, rising, count)
                out[row, column, k] = _median(rising, count)


def prepare() -> None:
    """Call each compiled function once."""
    predicted(np.zeros((2, 2, 2)))
    axes(np.zeros((2, 2, 2)))
