"""A chessboard with nothing but squares."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from render.targets import PATTERN_MEANING
from render.targets.lattice import Lattice, chess_lattice
from render.targets.squares import BoardOfSquares


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainChessboard(BoardOfSquares):
    """A chessboard; the origin is the first inner corner, and the square at negative x and y is black.

    Points: inner corners row by row. A board whose columns and rows are both even or both odd looks the same after half
    a turn: it is read as standing upright, x to the right in the picture. Its print with a white first square is
    found as well.

    Raises:
        ValueError: a value out of range.
    """

    pattern: Annotated[Literal["plain_chessboard"], PATTERN_MEANING] = "plain_chessboard"

    @property
    def tells_orientation(self) -> bool:
        """Whether the pattern differs from itself after half a turn."""
        return (self.columns + self.rows) % 2 == 1

    def draw(self) -> Lattice:
        """A cell for each square."""
        return chess_lattice(self.columns, self.rows, self.square_mm)
