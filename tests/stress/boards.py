"""A printed chessboard, flat or bent to a cylinder, with or without a raised disc: its points and its reflectance.

Frame, mm: origin at the first inner corner, x along the columns, y along the rows, z into the board; the square at
negative x and y is black. All edges are soft by the size of the cell that is drawn, as an area sampling makes them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

WHITE, BLACK, DISC = 0.8, 0.05, 0.04


@dataclass(frozen=True)
class Board:
    """What stands before the camera."""

    columns: int = 10  # squares
    rows: int = 7
    square: float = 100.0  # mm
    margin: float = 1.0  # white around the squares, in squares
    disc: bool = True
    disc_square: tuple[int, int] = (1, 2)  # column and row, from 1
    disc_radius: float = 30.0
    disc_height: float = 10.0
    curvature: float = 0.0  # 1 / mm, about an axis along y through the middle; the sides go away from the camera
    stretch: float = 1.0  # of the print along x, about the origin
    ink: float = 0.0  # by which black squares grow on each side, in squares
    print_grey: float = BLACK  # reflectance of black
    shadow_offset: float = 0.0  # of the disc's shadow along x, mm
    shadow_depth: float = 0.5  # share of the light that the disc takes away beneath itself
    shadow_edge: float = 6.0  # mm from full shadow to none
    mirrored: bool = False

    @property
    def inner(self):
        """Inner corners along x and y."""
        return self.columns - 1, self.rows - 1

    @property
    def middle(self):
        """x and y of the middle, mm, as printed."""
        return self.stretch * (self.columns - 2) * self.square / 2.0, (self.rows - 2) * self.square / 2.0

    def corners(self):
        """(n, 3) inner corners, x fastest, mm."""
        y, x = np.mgrid[0 : self.rows - 1, 0 : self.columns - 1]
        return self.on_surface(x.ravel() * self.square * self.stretch, y.ravel() * self.square)

    def disc_centre(self):
        """(3,) mm."""
        return self.on_surface(*np.reshape(self.disc_foot, (2, 1)))[0] - self.disc_height * self.disc_normal()

    @property
    def disc_foot(self):
        """Place of the disc along the sheet, mm."""
        return (self.disc_square[0] - 1.5) * self.square * self.stretch, (self.disc_square[1] - 1.5) * self.square

    def disc_normal(self):
        """(3,) unit normal under the disc, into the board."""
        angle = self.curvature * (self.disc_foot[0] - self.middle[0])
        return np.array([-np.sin(angle), 0.0, np.cos(angle)])

    def on_surface(self, along, y):
        """(n, 3) places of sheet coordinates, mm."""
        if self.curvature == 0.0:
            return np.stack((along, y, 0.0 * along), axis=1)
        angle = self.curvature * (along - self.middle[0])
        x = self.middle[0] + np.sin(angle) / self.curvature
        return np.stack((x, y, (1.0 - np.cos(angle)) / self.curvature), axis=1)

    def outline(self):
        """(n, 3) places on the border of the margin, mm."""
        reach = (1.0 + self.margin) * self.square
        s = np.linspace(-reach, (self.columns - 2) * self.square + reach, 24)
        t = np.linspace(-reach, (self.rows - 2) * self.square + reach, 24)
        along = np.concatenate((s, s, np.full(24, s[0]), np.full(24, s[-1]))) * self.stretch
        return self.on_surface(along, np.concatenate((np.full(24, t[0]), np.full(24, t[-1]), t, t)))

    def reflectance(self, along, y, across_u, across_v):
        """Reflectance at sheet coordinates and how much of each cell the sheet covers; `across_*` are a cell's mm."""
        u, v = along / (self.square * self.stretch) + 1.0, y / self.square + 1.0
        wide, high = (np.maximum(a / self.square, 1e-9) for a in (across_u, across_v))
        even_u, odd_u = _stripes(u, self.columns, wide, self.ink)
        even_v, odd_v = _stripes(v, self.rows, high, self.ink)
        black = np.minimum(1.0, even_u * even_v + odd_u * odd_v)
        black = black * _within(u, self.columns, wide, self.ink) * _within(v, self.rows, high, self.ink)
        covered = _within(u, self.columns, wide, self.margin) * _within(v, self.rows, high, self.margin)
        return (WHITE + (self.print_grey - WHITE) * black) * self._shadow(along, y), covered

    def _shadow(self, along, y):
        if not self.disc:
            return 1.0
        distance = np.hypot(along - self.disc_foot[0] - self.shadow_offset, y - self.disc_foot[1])
        inside = np.clip(0.5 + (self.disc_radius - distance) / self.shadow_edge, 0.0, 1.0)
        return 1.0 - self.shadow_depth * inside


def _stripes(q, count, width, grow):
    """How far each place lies in even and in odd squares along one axis, each grown on both sides."""
    inside = np.clip(q, 0.5, count - 0.5)
    depth = 0.5 - np.abs((inside + 0.5) % 2.0 - 1.0)
    return tuple(np.clip(0.5 + (sign * depth + grow) / width, 0.0, 1.0) for sign in (1.0, -1.0))


def _within(q, count, width, beyond):
    return np.clip(0.5 + (np.minimum(q, count - q) + beyond) / width, 0.0, 1.0)
