"""Points of a chessboard's lattice as a grid of places of which some are not known, and what the known say of these."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from eposit.arrays import Array, Mask
from pipelines.detection.saddle_links import STEPS, Piece
from pipelines.detection.saddles import Level, sample

TEMPLATE = np.array([-0.34, -0.23, -0.12, 0.12, 0.23, 0.34])  # squares from a corner, along x and y
AROUND = tuple((x, y) for x in (-1, 0, 1) for y in (-1, 0, 1))
SIGNS = np.sign(np.multiply.outer(TEMPLATE, TEMPLATE)).ravel()  # of the brightness there, rows are y


class Grid(NamedTuple):
    """A lattice's points. The square of positive steps from the point of column x and row y is white if x + y is even
    and `white_first` holds, or neither is so."""

    points: Array  # (rows, columns, 2) px, NaN where not known
    white_first: bool

    @property
    def known(self) -> Mask:
        """(rows, columns) True where the point is known."""
        return np.isfinite(self.points[..., 0])

    @property
    def signs(self) -> Array:
        """(rows, columns) 1 where the square of positive steps is white, else -1."""
        rows, columns = self.points.shape[:2]
        even = np.add.outer(np.arange(rows), np.arange(columns)) % 2 == 0
        return np.where(even == self.white_first, 1.0, -1.0)

    def padded(self, by: int) -> Grid:
        """With so many unknown columns and rows on each side."""
        return Grid(np.pad(self.points, ((by, by), (by, by), (0, 0)), constant_values=np.nan), self.white_first)

    def cropped(self) -> Grid:
        """Without columns and rows in which nothing is known."""
        rows, columns = np.flatnonzero(self.known.any(axis=1)), np.flatnonzero(self.known.any(axis=0))
        if not len(rows):
            return Grid(np.empty((0, 0, 2)), self.white_first)
        part = self.points[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        return Grid(part, self.white_first == bool((rows[0] + columns[0]) % 2 == 0))

    def with_points(self, points: Array) -> Grid:
        """With other points, (rows, columns, 2) px."""
        return Grid(points, self.white_first)


def grid_of(piece: Piece) -> Grid:
    """The piece's saddles."""
    low = piece.cells.min(axis=0)
    columns, rows = piece.cells.max(axis=0) - low + 1
    points = np.full((rows, columns, 2), np.nan)
    x, y = (piece.cells - low).T
    points[y, x] = piece.points
    return Grid(points, piece.white_first == bool(low.sum() % 2 == 0))


def predicted(points: Array) -> Array:
    """(rows, columns, 2) px where each point would be by those near it, NaN where too few are: lines go on straight,
    and squares are parallelograms."""
    wide, size = _padded(points), points.shape[:2]
    one = [_moved(wide, size, *step) for step in STEPS]
    two = [_moved(wide, size, 2 * x, 2 * y) for x, y in STEPS]
    guesses = [2.0 * near - far for near, far in zip(one, two, strict=True)]
    for a, b in ((0, 1), (1, 2), (2, 3), (3, 0)):
        (ax, ay), (bx, by) = STEPS[a], STEPS[b]
        guesses.append(one[a] + one[b] - _moved(wide, size, ax + bx, ay + by))
    return _median(np.stack(guesses))


def axes(points: Array) -> tuple[Array, Array]:
    """(rows, columns, 2) px along x and along y of the squares around each point, NaN where none is known."""
    size, along = points.shape[:2], []
    for axis, beyond in ((1, ((-2, 0), (-2, 1), (-2, -1))), (0, ((0, -2), (1, -2), (-1, -2)))):
        steps = np.full_like(points, np.nan)
        steps[tuple(slice(-1) if k == axis else slice(None) for k in range(2))] = np.diff(points, axis=axis)
        wide = _padded(steps)
        along.append(_median(np.stack([_moved(wide, size, x, y) for x, y in (*AROUND, *beyond)])))
    return along[0], along[1]


def likeness(level: Level, places: Array, along_x: Array, along_y: Array, signs: Array) -> tuple[Array, Array]:
    """How much (n, 2) places look like corners of a chessboard, and with which contrast.

    along_x, along_y: (n, 2) px, sides of the squares. signs: (n,) as `Grid.signs`. Returns (n,) correlations, up to 1,
    and (n,) half differences between white and black, grey levels; NaN where the picture ends.
    """
    u, v = np.tile(TEMPLATE, len(TEMPLATE)), np.repeat(TEMPLATE, len(TEMPLATE))
    grey = sample(level, places[:, None] + u[:, None] * along_x[:, None] + v[:, None] * along_y[:, None])
    grey = grey - grey.mean(axis=1, keepdims=True)
    contrast = signs * (grey @ SIGNS) / len(SIGNS)
    return contrast / np.maximum(np.sqrt(np.mean(grey**2, axis=1)), 1e-6), contrast


def _padded(points: Array) -> Array:
    """With two unknown columns and rows on each side."""
    rows, columns = points.shape[:2]
    out = np.full((rows + 4, columns + 4, 2), np.nan)
    out[2:-2, 2:-2] = points
    return out


def _moved(wide: Array, size: tuple[int, ...], x: int, y: int) -> Array:
    """At each place what is known x columns and y rows further, of points that were `_padded`; at most two."""
    return wide[2 + y : 2 + y + size[0], 2 + x : 2 + x + size[1]]


def _median(values: Array) -> Array:
    """Median over the first axis of what is known; NaN where nothing is. `np.nanmedian` takes ten times as long."""
    rising = np.sort(values, axis=0)  # NaN last
    count = np.sum(np.isfinite(values), axis=0)
    low, high = (np.take_along_axis(rising, np.maximum(k, 0)[None], 0)[0] for k in ((count - 1) // 2, count // 2))
    return np.where(count > 0, 0.5 * (low + np.where(count % 2 == 0, high, low)), np.nan)
