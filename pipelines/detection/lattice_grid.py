"""Points of a chessboard's lattice as a grid of places of which some are not known."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from eposit.arrays import Array, Mask
from pipelines.detection.saddle_links import Piece


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
        rows, columns = self.points.shape[:2]
        points = np.full((rows + 2 * by, columns + 2 * by, 2), np.nan)  # a third of the time of np.pad
        points[by : by + rows, by : by + columns] = self.points
        return Grid(points, self.white_first)

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
