"""What printed boards of squares share: a chessboard's squares, with or without markers in the white ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from eposit.arrays import Array
from render.targets.printed import PrintedBoard, check_counts, check_length, grid_points

LEAST_SQUARES, MOST_SQUARES = 3, 60


@dataclass(frozen=True, slots=True, kw_only=True)
class BoardOfSquares(PrintedBoard):
    """Black and white squares; the origin is the first inner corner, and the square at negative x and y is black.

    Points: inner corners row by row.
    """

    columns: Annotated[int, "squares along x"] = 10
    rows: Annotated[int, "squares along y"] = 7
    square_mm: Annotated[float, "side of a square, mm"] = 100.0

    def check_pattern(self) -> None:
        """Refuse a pattern that cannot be."""
        check_counts("squares", self.columns, self.rows, LEAST_SQUARES, MOST_SQUARES)
        check_length("square_mm", self.square_mm)

    @property
    def unit_mm(self) -> float:
        """Side of a square, mm."""
        return self.square_mm

    @property
    def inner(self) -> tuple[int, int]:
        """Inner corners along x and along y."""
        return self.columns - 1, self.rows - 1

    @property
    def point_grid(self) -> tuple[int, int]:
        """Columns and rows of the inner corners."""
        return self.inner

    @property
    def pattern_points(self) -> Array:
        """(n, 2) inner corners, mm, x fastest."""
        return grid_points(*self.inner, self.square_mm)

    @property
    def pattern_extent_mm(self) -> tuple[float, float, float, float]:
        """Of the squares, mm."""
        square = self.square_mm
        return -square, (self.columns - 1) * square, -square, (self.rows - 1) * square
