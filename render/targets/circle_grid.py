"""Grids of black discs, as OpenCV's `findCirclesGrid` reads them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from eposit.arrays import Array
from render.targets import PATTERN_MEANING
from render.targets.lattice import Lattice
from render.targets.printed import PrintedBoard, check_counts, check_length, grid_points

LEAST_CIRCLES, MOST_CIRCLES = 2, 60
MOST_RADIUS = 0.45  # of the spacing


@dataclass(frozen=True, slots=True, kw_only=True)
class CircleGrid(PrintedBoard):
    """Black discs on white; the origin is the centre of the first.

    Points: centres row by row. On the asymmetric grid every other row is shifted by one spacing, and the discs of a row
    are two spacings apart, as in OpenCV: disc j of row i lies at x = (2 j + i mod 2) spacing, y = i spacing. With an
    odd number of rows that grid tells its orientation. The symmetric one, and the asymmetric one with an even number
    of rows, look the same after half a turn: they are read as standing upright, x to the right in the picture.

    Raises:
        ValueError: a value out of range.
    """

    pattern: Annotated[Literal["circles"], PATTERN_MEANING] = "circles"
    columns: Annotated[int, "discs in a row"] = 4
    rows: Annotated[int, "rows of discs"] = 11
    spacing_mm: Annotated[float, "distance of rows, and of the discs of a row of the symmetric grid, mm"] = 60.0
    diameter_mm: Annotated[float, "diameter of a disc, mm"] = 40.0
    asymmetric: Annotated[bool, "whether every other row is shifted"] = True

    def check_pattern(self) -> None:
        """Refuse a pattern that cannot be."""
        check_counts("circles", self.columns, self.rows, LEAST_CIRCLES, MOST_CIRCLES)
        check_length("spacing_mm", self.spacing_mm)
        most = 2.0 * MOST_RADIUS * self.spacing_mm
        if not 0.1 * self.spacing_mm <= self.diameter_mm <= most:
            raise ValueError(
                f"target diameter_mm is {self.diameter_mm}; it must lie in 0.1 to {2.0 * MOST_RADIUS:g} spacings, "
                f"{0.1 * self.spacing_mm:g} to {most:g} mm"
            )

    @property
    def tells_orientation(self) -> bool:
        """Whether the pattern differs from itself after half a turn."""
        return self.asymmetric and self.rows % 2 == 1

    @property
    def unit_mm(self) -> float:
        """Spacing of the discs, mm."""
        return self.spacing_mm

    @property
    def point_grid(self) -> tuple[int, int]:
        """Discs in a row, and rows."""
        return self.columns, self.rows

    @property
    def pattern_points(self) -> Array:
        """(n, 2) centres, mm, row by row."""
        points = grid_points(self.columns, self.rows, 1.0)
        if self.asymmetric:
            points[:, 0] = 2.0 * points[:, 0] + points[:, 1] % 2.0
        return points * self.spacing_mm

    @property
    def pattern_extent_mm(self) -> tuple[float, float, float, float]:
        """Of the discs and half a spacing around their centres, mm."""
        half, last = 0.5 * self.spacing_mm, self.pattern_points.max(axis=0)
        return -half, float(last[0]) + half, -half, float(last[1]) + half

    def draw(self) -> Lattice:
        """A cell of one spacing around each place where a disc may be."""
        places = np.rint(self.pattern_points / self.spacing_mm).astype(int)
        columns, rows = places.max(axis=0) + 1
        discs = np.zeros((rows, columns), bool)
        discs[places[:, 1], places[:, 0]] = True
        x_lines, y_lines = (self.spacing_mm * (np.arange(n + 1.0) - 0.5) for n in (columns, rows))
        return Lattice(x_lines, y_lines, np.zeros_like(discs), discs, 0.5 * self.diameter_mm)
