"""Calibration targets: which points they have, where their brightness jumps, and how they reflect light."""

from __future__ import annotations

from typing import Protocol

from eposit.arrays import Array
from render.targets.lattice import Lattice
from render.targets.sheet import Sheet

PATTERN_MEANING = "kind of the target: chessboard (with a raised circle), plain_chessboard, charuco, aprilgrid, circles"


class Target(Protocol):
    """A board with points to be found in its image, in its own frame, mm: x and y along it, z into it.

    What poses, regions, motion, tables and scenes need of any target; the kinds are in `render.targets.kinds`.
    A point's number in `points` is its id.
    """

    @property
    def white(self) -> float:
        """Reflectance of what is white."""
        ...

    @property
    def black(self) -> float:
        """Reflectance of what is black."""
        ...

    @property
    def sheet(self) -> Sheet:
        """What the pattern is printed on: its extent with the margin, its scale, how it is bent."""
        ...

    def lattice(self) -> Lattice:
        """The printed pattern, in nominal lengths."""
        ...

    @property
    def front_mm(self) -> float:
        """Least z of the target, mm: a camera behind it does not see the front."""
        ...

    @property
    def point_grid(self) -> tuple[int, int]:
        """Columns and rows of the points of the print, which come first in `points`, row by row."""
        ...

    def rim(self, point: int) -> Array | None:
        """(n, 3) outline, mm, of what a point is the centre of; None for a corner."""
        ...

    @property
    def points(self) -> Array:
        """(n, 3) all points, mm."""
        ...

    @property
    def board_centre(self) -> Array:
        """(3,) centre of the pattern, mm: what trajectories carry and light is aimed at."""
        ...

    @property
    def extent_mm(self) -> tuple[float, float, float, float]:
        """x_min, x_max, y_min, y_max of the board with its margin, mm."""
        ...

    def outline(self) -> Array:
        """(n, 3) points, mm, that bound the target's image."""
        ...
