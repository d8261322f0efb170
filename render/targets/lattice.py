"""A printed pattern as values: a rectilinear lattice of black and white cells, and black discs within cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array

Cells = NDArray[np.bool_]  # (rows, columns)
SAME_LINE = 1e-9  # of the lattice's length: lines that are nearer to each other than this are one


@dataclass(frozen=True, slots=True, eq=False)
class Lattice:
    """Cells between lines, which need not be evenly spaced; around them the board is white."""

    x_lines: Array  # (columns + 1,) rising, mm, before the print is scaled or bent
    y_lines: Array  # (rows + 1,)
    black: Cells
    discs: Cells  # white cells with a black disc in the middle
    disc_radius_mm: float = 0.0

    @property
    def disc_centres(self) -> Array:
        """(n, 2) mm, row by row."""
        rows, columns = np.nonzero(self.discs)
        x, y = (0.5 * (lines[1:] + lines[:-1]) for lines in (self.x_lines, self.y_lines))
        return np.stack((x[columns], y[rows]), axis=1)

    @property
    def least_gap_mm(self) -> float:
        """The smallest distance between two lines."""
        return float(min(np.diff(self.x_lines).min(), np.diff(self.y_lines).min()))


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A rectangle of one colour on the board; those that come later lie on those before."""

    x: float  # mm, the side of least x
    y: float  # the side of least y
    width: float
    height: float
    black: bool = True


def lattice_of(rectangles: list[Rectangle]) -> Lattice:
    """The coarsest lattice whose lines hold the sides of all rectangles."""
    x_lines = _distinct([side for r in rectangles for side in (r.x, r.x + r.width)])
    y_lines = _distinct([side for r in rectangles for side in (r.y, r.y + r.height)])
    black = np.zeros((len(y_lines) - 1, len(x_lines) - 1), bool)
    for r in rectangles:
        left, right = (_nearest(x_lines, side) for side in (r.x, r.x + r.width))
        top, bottom = (_nearest(y_lines, side) for side in (r.y, r.y + r.height))
        black[top:bottom, left:right] = r.black
    return Lattice(x_lines, y_lines, black, np.zeros_like(black))


def chess_lattice(columns: int, rows: int, square_mm: float) -> Lattice:
    """Squares, the first of them black; its inner corner is the origin."""
    black = np.add.outer(np.arange(rows), np.arange(columns)) % 2 == 0
    x_lines, y_lines = (square_mm * np.arange(-1.0, n) for n in (columns, rows))
    return Lattice(x_lines, y_lines, black, np.zeros_like(black))


def bit_rectangles(bits: Cells, x: float, y: float, module: float) -> list[Rectangle]:
    """The white bits of a marker (n, n), whose first bit's sides of least x and y are given, mm."""
    rows, columns = np.nonzero(bits)
    return [
        Rectangle(x + column * module, y + row * module, module, module, black=False)
        for row, column in zip(rows.tolist(), columns.tolist(), strict=True)
    ]


def _distinct(values: list[float]) -> Array:
    """Rising values without those that differ by rounding only."""
    rising = np.unique(np.array(values))
    apart = np.diff(rising, prepend=-np.inf) > SAME_LINE * (rising[-1] - rising[0])
    return rising[apart]


def _nearest(lines: Array, value: float) -> int:
    return int(np.argmin(np.abs(lines - value)))
