"""Calibration targets: which points they have, where their brightness jumps, and how they reflect light."""

from __future__ import annotations

from typing import Protocol

from eposit.arrays import Array


class Target(Protocol):
    """A flat board with points to be found in its image, in its own frame, mm: x and y along it, z into it.

    What poses, regions, motion and tables need of any target. Rendering and detection need the kind of target, such as
    `render.targets.chessboard.Chessboard`.
    """

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
