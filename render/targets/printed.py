"""What all printed boards share: a pattern of black on white with a margin, on a sheet that may be scaled and bent."""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from eposit.arrays import Array
from render.targets.lattice import Lattice
from render.targets.sheet import BendAxis, Sheet
from render.targets.typed import check_types

MAX_LINES = 255  # of a lattice along x or y: what the renderer's tables hold
MAX_MARGIN_MM = 1e4
RIM_STEPS = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class PrintedBoard(ABC):
    """A board with a printed pattern and nothing that stands out of it.

    Its points are where they are on the scaled and bent board.
    """

    margin_mm: Annotated[float, "white margin around the pattern, mm"] = 50.0
    white: Annotated[float, "reflectance of what is white"] = 0.8
    black: Annotated[float, "reflectance of what is black"] = 0.05
    print_scale: Annotated[tuple[float, float], "size of the print along x and y, as a share of the nominal one"] = (
        1.0,
        1.0,
    )
    bend_sag_mm: Annotated[
        float, "how far the bent board's borders lie behind its middle, seen from the camera, mm; below 0 before it"
    ] = 0.0
    bend_axis: Annotated[
        BendAxis, "direction along which the board is bent: x or y, a part of a cylinder; both, a shallow bowl"
    ] = "x"

    def __post_init__(self) -> None:
        check_types(self)
        if not 0.0 <= self.margin_mm <= MAX_MARGIN_MM:
            raise ValueError(f"target margin_mm is {self.margin_mm}; it must lie in 0 to {MAX_MARGIN_MM:g} mm")
        for name in ("white", "black"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"target {name} is {getattr(self, name)}; a reflectance lies in 0 to 1")
        if not self.white > self.black:
            raise ValueError(f"target white is {self.white} and black {self.black}; white must reflect more than black")
        self.check_pattern()
        self.sheet.check("target")

    @abstractmethod
    def check_pattern(self) -> None:
        """Refuse a pattern that cannot be.

        Raises:
            ValueError: what is wrong, what is allowed.
        """

    @abstractmethod
    def draw(self) -> Lattice:
        """The pattern, in nominal lengths, drawn anew."""

    @property
    @abstractmethod
    def unit_mm(self) -> float:
        """The length that detection counts in, mm: the side of a square or tag, or the spacing of discs."""

    @property
    @abstractmethod
    def pattern_points(self) -> Array:
        """(n, 2) nominal places of the points on the print, mm; a point's number is its id."""

    @property
    @abstractmethod
    def pattern_extent_mm(self) -> tuple[float, float, float, float]:
        """Nominal x_min, x_max, y_min, y_max of the pattern without its margin, mm."""

    @property
    @abstractmethod
    def point_grid(self) -> tuple[int, int]:
        """Columns and rows of the points, which are numbered row by row."""

    def lattice(self) -> Lattice:
        """The pattern, in nominal lengths."""
        return _drawn(self)

    @property
    def sheet(self) -> Sheet:
        """What the pattern is printed on, with the margin."""
        x0, x1, y0, y1 = self.pattern_extent_mm
        margin = self.margin_mm
        extent = (x0 - margin, x1 + margin, y0 - margin, y1 + margin)
        return Sheet(extent, self.print_scale, self.bend_sag_mm, self.bend_axis)

    @property
    def points(self) -> Array:
        """(n, 3) all points, mm."""
        return self.sheet.lift(self.pattern_points)

    @property
    def board_centre(self) -> Array:
        """(3,) centre of the pattern, mm."""
        return np.array([*self.sheet.centre, 0.0])

    @property
    def extent_mm(self) -> tuple[float, float, float, float]:
        """x_min, x_max, y_min, y_max of the board with its margin, mm."""
        border = self._border(2)
        (x0, y0), (x1, y1) = border[:, :2].min(axis=0), border[:, :2].max(axis=0)
        return float(x0), float(x1), float(y0), float(y1)

    @property
    def front_mm(self) -> float:
        """Least z of the board, mm."""
        return float(min(0.0, self._border(9)[:, 2].min()))

    def outline(self, steps: int = 64) -> Array:
        """(n, 3) points along the board's border, mm, that bound its image.

        Of a bent board, lines across it as well: where it bulges its border bounds nothing.
        """
        x0, x1, y0, y1 = self.sheet.extent_mm
        if self.bend_sag_mm == 0.0:
            return self._border(steps)
        x, y = np.meshgrid(np.linspace(x0, x1, steps), np.linspace(y0, y1, steps))
        return self.sheet.lift(np.stack((x.ravel(), y.ravel()), axis=1))

    def rim(self, point: int) -> Array | None:
        """(n, 3) outline, mm, of what the point is the centre of; None for a corner."""
        lattice = self.lattice()
        if not lattice.disc_radius_mm:
            return None
        angle = np.arange(RIM_STEPS) * (2.0 * np.pi / RIM_STEPS)
        circle = lattice.disc_radius_mm * np.stack((np.cos(angle), np.sin(angle)), axis=1)
        return self.sheet.lift(self.pattern_points[point] + circle)

    def _border(self, steps: int) -> Array:
        x0, x1, y0, y1 = self.sheet.extent_mm
        s = np.linspace(0.0, 1.0, steps)
        x, y, one = x0 + (x1 - x0) * s, y0 + (y1 - y0) * s, np.ones(steps)
        sides = [(x, y0 * one), (x, y1 * one), (x0 * one, y), (x1 * one, y)]
        return self.sheet.lift(np.concatenate([np.column_stack(side) for side in sides]))


@functools.lru_cache(maxsize=16)
def _drawn(board: PrintedBoard) -> Lattice:
    return board.draw()


def check_counts(owner: str, columns: int, rows: int, least: int, most: int) -> None:
    """Refuse numbers of columns and rows outside a range.

    owner: what is counted, such as "squares".

    Raises:
        ValueError: a number out of range.
    """
    if not (least <= columns <= most and least <= rows <= most):
        raise ValueError(f"target has {columns} x {rows} {owner}; each number must lie in {least} to {most}")


def check_length(name: str, value: float) -> None:
    """Refuse a length that is none.

    Raises:
        ValueError: not above 0.
    """
    if not value > 0.0:
        raise ValueError(f"target {name} is {value}; it must be above 0 mm")


def grid_points(columns: int, rows: int, spacing: float) -> Array:
    """(n, 2) points of a square grid, mm, x fastest, the first at the origin."""
    y, x = np.mgrid[0:rows, 0:columns]
    return np.stack((x.ravel(), y.ravel()), axis=1) * spacing
