"""The whole board with its circle by brute force, bent about an axis or printed at a wrong scale."""

import numpy as np
from scipy.spatial.transform import Rotation

from render.targets.chessboard import Chessboard
from tests.supersampled import picture

TARGET = Chessboard()  # all lengths below in its squares
AT, RADIUS, HEIGHT = np.array([-0.5, 0.5]), 0.3, 0.1
WIDTH, TALL = 640, 480
WHITE, BLACK, DISC, BEHIND = 200.0, 15.0, 10.0, 80.0  # grey values
CELLS = 4  # to a pixel
BLUR = 0.7  # px
HALF = 5.5  # squares from the board's middle to its end
TURNS = 6  # of finding where a ray meets a bent board: each is good to a twentieth of the one before


class BentBoard:
    """A board before a pinhole camera. sag: squares that its middle stands out; stretch: of the print along x and y."""

    def __init__(
        self, angles=(25.0, -20.0, 15.0), place=(0.2, 0.1, 13.0), focal=(620.0, 620.0), sag=0.0, stretch=(1.0, 1.0)
    ):
        self.R = Rotation.from_euler("xyz", angles, degrees=True).as_matrix()
        self.t = np.array(place) - self.R[:, :2] @ [4.0, 2.5]
        self.focal, self.sag, self.stretch = np.array(focal), sag, np.array(stretch)
        self.centre = np.array([(WIDTH - 1) / 2.0, (TALL - 1) / 2.0])

    def bulge(self, x):
        """Height of the bent sheet at x."""
        return self.sag * (1.0 - ((x - 4.0) / HALF) ** 2)

    def project(self, at, height=0.0):
        """(n, 2) px of (n, 2) places of the print, so far above the sheet."""
        x, y = (np.asarray(at) * self.stretch).T
        points = np.stack((x, y, -self.bulge(x) - height), axis=1) @ self.R.T + self.t
        return self.focal * points[:, :2] / points[:, 2:] + self.centre

    def _meet(self, u, v, height):
        """Places of the sheet, or of one parallel to it, where the rays of pixels meet it."""
        ray = (
            np.stack(
                ((u - self.centre[0]) / self.focal[0], (v - self.centre[1]) / self.focal[1], np.ones_like(u)), axis=-1
            )
            @ self.R
        )
        origin, rise = -self.R.T @ self.t, 0.0
        for _ in range(TURNS if self.sag else 1):
            reach = (-height - rise - origin[2]) / ray[..., 2]
            x, y = origin[0] + reach * ray[..., 0], origin[1] + reach * ray[..., 1]
            rise = self.bulge(x)
        return x / self.stretch[0], y / self.stretch[1]

    def drawn(self):
        """(480, 640) grey values."""

        def grey(u, v):
            x, y = self._meet(u, v, 0.0)
            squares = (x > -1) & (x < 9) & (y > -1) & (y < 6)
            black = squares & ((np.floor(x) + np.floor(y)) % 2 == 0)
            board = (x > -2) & (x < 10) & (y > -2) & (y < 7)
            value = np.where(black, BLACK, np.where(board, WHITE, BEHIND))
            p, q = self._meet(u, v, HEIGHT)
            away = np.hypot(x - AT[0] - 0.04, y - AT[1] + 0.02)  # of a soft shadow
            value = value * (1.0 - 0.45 * np.clip((RADIUS + 0.03 - away) / 0.06, 0.0, 1.0))
            return np.where((p - AT[0]) ** 2 + (q - AT[1]) ** 2 < RADIUS**2, DISC, value)

        return picture(grey, WIDTH, TALL, BLUR, CELLS)
