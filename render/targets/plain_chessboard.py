"""A chessboard with nothing but squares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from eposit.arrays import Array
from render.targets import PATTERN_MEANING
from render.targets.lattice import Lattice, chess_lattice
from render.targets.printed import PrintedBoard, check_counts, check_length, grid_points

LEAST_SQUARES, MOST_SQUARES = 3, 60


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainChessboard(PrintedBoard):
    """A chessboard; the origin is the first inner corner, and the square at negative x and y is black.

    Points: inner corners row by row. A board whose columns and rows are both even or both odd looks the same after half
    a turn: it is read as standing upright, x to the right in the picture.

    Raises:
        ValueError: a value out of range.
    """

    pattern: Annotated[Literal["plain_chessboard"], PATTERN_MEANING] = "plain_chessboard"
    columns: Annotated[int, "squares along x"] = 10
    rows: Annotated[int, "squares along y"] = 7
    square_mm: Annotated[float, "side of a square, mm"] = 100.0

    def check_pattern(self) -> None:
        """Refuse a pattern that cannot be."""
        check_counts("squares", self.columns, self.rows, LEAST_SQUARES, MOST_SQUARES)
        check_length("square_mm", self.square_mm)

    @property
    def tells_orientation(self) -> bool:
        """Whether the pattern differs from itself after half a turn."""
        return (self.columns + self.rows) % 2 == 1

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

    def draw(self) -> Lattice:
        """A cell for each square."""
        return chess_lattice(self.columns, self.rows, self.square_mm)
