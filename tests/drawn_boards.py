"""Chessboards drawn by brute force: through an equidistant fish-eye or a pinhole, with the raised circle or without.

Nothing here is shared with the renderer or the detection.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.supersampled import digitised, picture

BEHIND = 90.0  # grey level of what is not the board


@dataclass(frozen=True)
class Drawing:
    """A board and a camera. Lengths are in squares."""

    columns: int = 10
    rows: int = 7
    margin: float = 1.0
    circle: tuple[int, int] | None = (1, 2)  # column and row of its square, from 1
    circle_radius: float = 0.3
    circle_height: float = 0.1
    white: float = 200.0
    black: float = 20.0
    exchanged: bool = False  # squares that are black elsewhere are white, and white ones black
    lens: str = "fisheye"  # equidistant, or "pinhole"
    focal_px: float = 300.0
    width: int = 640
    height: int = 480
    distance: float = 12.0
    angles_deg: tuple[float, float, float] = (20.0, -15.0, 10.0)  # about x, then y, then z
    shift: tuple[float, float] = (0.0, 0.0)  # of the board's middle in the camera's x and y
    blur_px: float = 0.7
    noise: float = 0.5
    cells: int = 3  # to a pixel along each side

    @property
    def corners(self):
        """(n, 3) inner corners, x fastest."""
        y, x = np.mgrid[0 : self.rows - 1, 0 : self.columns - 1]
        return np.stack((x.ravel(), y.ravel(), 0.0 * x.ravel()), axis=1)

    @property
    def circle_centre(self):
        """(3,) z is into the board."""
        return np.array([self.circle[0] - 1.5, self.circle[1] - 1.5, -self.circle_height])

    def pose(self):
        """R (3, 3) and t (3,) of the camera's frame from the board's."""
        a, b, c = np.deg2rad(self.angles_deg)
        rx = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
        ry = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
        rz = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
        R = rz @ ry @ rx
        middle = np.array([(self.columns - 2) / 2.0, (self.rows - 2) / 2.0, 0.0])
        return R, np.array([*self.shift, self.distance]) - R @ middle

    def project(self, points):
        """(n, 3) points to (n, 2) px."""
        R, t = self.pose()
        x, y, z = (points @ R.T + t).T
        side = np.hypot(x, y)
        radius = np.arctan2(side, z) if self.lens == "fisheye" else side / z
        scale = self.focal_px * radius / np.maximum(side, 1e-12)
        centre = (np.array([self.width, self.height]) - 1.0) / 2.0
        return np.stack((scale * x, scale * y), axis=1) + centre

    def truth(self):
        """(n, 2) px of the inner corners, then of the circle if there is one."""
        points = self.corners if self.circle is None else np.vstack((self.corners, self.circle_centre))
        return self.project(points)

    def grey(self, x, y):
        """Grey levels at px."""
        R, t = self.pose()
        u, v = (x - (self.width - 1.0) / 2.0) / self.focal_px, (y - (self.height - 1.0) / 2.0) / self.focal_px
        radius = np.hypot(u, v)
        theta = radius if self.lens == "fisheye" else np.arctan(radius)
        side = np.sin(theta) / np.maximum(radius, 1e-12)
        ray = np.stack((side * u, side * v, np.cos(theta)))
        normal = R[:, 2]
        toward = np.tensordot(normal, ray, 1)
        toward = np.where(np.abs(toward) < 1e-9, 1e-9, toward)

        def meets(height):
            """Where rays meet the plane so far before the board, in the board's x and y."""
            reach = (normal @ t - height) / toward
            at = ray * reach - t[:, None, None]
            return np.tensordot(R[:, 0], at, 1), np.tensordot(R[:, 1], at, 1), reach > 0.0

        bx, by, front = meets(0.0)
        column, row = np.floor(bx) + 1, np.floor(by) + 1
        inside = (column >= 0) & (column < self.columns) & (row >= 0) & (row < self.rows)
        black = inside & ((column + row) % 2 == int(self.exchanged))
        m = 1.0 + self.margin
        board = (bx > -m) & (bx < self.columns - 2 + m) & (by > -m) & (by < self.rows - 2 + m)
        out = np.where(front & board, np.where(black, self.black, self.white), BEHIND)
        if self.circle is not None:
            cx, cy, front = meets(self.circle_height)
            centre = self.circle_centre
            out = np.where(front & (np.hypot(cx - centre[0], cy - centre[1]) < self.circle_radius), self.black, out)
        return out

    def linear(self):
        """(height, width) grey levels without noise, not rounded."""
        return picture(self.grey, self.width, self.height, self.blur_px, self.cells)

    def image(self, seed=0):
        """8 bits."""
        return digitised(self.linear(), np.random.default_rng(seed), self.noise)
