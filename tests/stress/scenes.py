"""What a pixel's ray meets: board, disc, background, things before the board; as soft as the cell that is drawn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from tests.stress.boards import DISC, Board
from tests.stress.lenses import Lens

STEP = 0.25  # px, over which slopes of the sheet's coordinates are taken
GREY = 0.3
BESIDE = 8.0  # px around the board's outline in which it is looked for


def plain(x, y, cell):
    """A background without anything."""
    return np.full(np.shape(x), GREY)


@dataclass(frozen=True)
class Cover:
    """Something before the board, in the picture's own px."""

    depth: Callable  # signed distance inside, px, of places (x, y)
    grey: float = 0.45
    opacity: float = 1.0  # below 1: a shadow with a hard edge


@dataclass(frozen=True)
class Scene:
    """One board before one lens."""

    board: Board | None
    lens: Lens
    R: np.ndarray  # cam_from_obj
    t: np.ndarray
    background: Callable = plain
    covers: tuple[Cover, ...] = field(default=())

    def grey(self, x, y, cell, slopes):
        """Radiance at places (n,) px, averaged over about `cell` px; `slopes` are those of `slopes` near by."""
        value = self.background(x, y, cell)
        near = np.isfinite(slopes[0])
        if np.any(near):
            value[near] = self._board_over(value[near], x[near], y[near], cell * slopes[:, near])
        for cover in self.covers:
            inside = np.clip(0.5 + cover.depth(x, y) / cell, 0.0, 1.0) * cover.opacity
            value = value * (1.0 - inside) + cover.grey * inside * (cover.opacity == 1.0)
        return value

    def slopes(self, x, y):
        """(4, n) mm: what a pixel spans of the sheet's two coordinates and of the disc's two; NaN beside the board."""
        slopes = np.full((4, len(x)), np.nan)
        if self.board is None:
            return slopes
        outline = self.outline()
        low, high = outline.min(axis=0) - BESIDE, outline.max(axis=0) + BESIDE
        near = (x > low[0]) & (x < high[0]) & (y > low[1]) & (y < high[1])
        steps = ((0.0, 0.0), (STEP, 0.0), (0.0, STEP))
        here, right, below = (self._places(x[near] + dx, y[near] + dy) for dx, dy in steps)
        with np.errstate(invalid="ignore"):
            slopes[:, near] = np.hypot(right - here, below - here) / STEP
        return slopes

    def truth(self):
        """(n + 1, 2) px: inner corners, then the disc's centre."""
        points = np.vstack((self.board.corners(), self.board.disc_centre()))
        return self.lens.project(self._mirrored(points) @ self.R.T + self.t)

    def outline(self):
        """(n, 2) px of the board's border."""
        return self.lens.project(self._mirrored(self.board.outline()) @ self.R.T + self.t)

    def _mirrored(self, points):
        if not self.board.mirrored:
            return points
        middle = np.array([self.board.middle[0], 0.0, 0.0])
        return (points - middle) * np.array([-1.0, 1.0, 1.0]) + middle

    def _board_over(self, value, x, y, spans):
        """The sheet, then the disc, over what is behind."""
        u, v, p, q = self._places(x, y)
        with np.errstate(invalid="ignore"):
            sheet, covered = self.board.reflectance(u, v, *spans[:2])
            value = _over(value, sheet, covered)
            if not self.board.disc:
                return value
            radius = np.hypot(p, q)
            span = np.hypot(spans[2] * p, spans[3] * q) / np.maximum(radius, 1e-9)
            return _over(
                value, DISC, np.clip(0.5 + (self.board.disc_radius - radius) / np.maximum(span, 1e-9), 0.0, 1.0)
            )

    def _places(self, x, y):
        """Four of (n,) mm: where rays meet the sheet, along it, and the disc's plane, from its centre."""
        origin, along = self._ray(x, y)
        return np.stack((*self._on_sheet(origin, along), *self._on_disc(origin, along)))

    def _ray(self, x, y):
        """Origin (3,) and directions (n, 3) in the board's frame."""
        origin, rays = -self.R.T @ self.t, self.lens.rays(x, y)
        along = np.stack([sum(rays[:, i] * self.R[i, j] for i in range(3)) for j in range(3)], axis=1)
        if self.board.mirrored:
            origin, along = self._mirrored(origin[None])[0], along * np.array([-1.0, 1.0, 1.0])
        return origin, along

    def _on_sheet(self, origin, along):
        middle, k = self.board.middle[0], self.board.curvature
        o = origin - np.array([middle, 0.0, 0.0])
        if k == 0.0:
            with np.errstate(all="ignore"):
                s = -o[2] / along[:, 2]
            s = np.where(s > 0.0, s, np.nan)
            return middle + o[0] + s * along[:, 0], o[1] + s * along[:, 1]
        # k (X^2 + Z^2) = 2 Z on the cylinder; the root that stays where the sheet is when k goes to 0.
        a = k * (along[:, 0] ** 2 + along[:, 2] ** 2)
        b = 2.0 * k * (o[0] * along[:, 0] + o[2] * along[:, 2]) - 2.0 * along[:, 2]
        c = k * (o[0] ** 2 + o[2] ** 2) - 2.0 * o[2]
        with np.errstate(all="ignore"):
            s = 2.0 * c / (-b + np.sqrt(b * b - 4.0 * a * c))
            s = np.where(s > 0.0, s, np.nan)
        at = o + s[:, None] * along
        return middle + np.arctan2(k * at[:, 0], 1.0 - k * at[:, 2]) / k, at[:, 1]

    def _on_disc(self, origin, along):
        if not self.board.disc:
            return (np.full(len(along), np.nan),) * 2
        centre, normal = self.board.disc_centre(), self.board.disc_normal()
        with np.errstate(all="ignore"):
            s = ((centre - origin) @ normal) / (along @ normal)
        at = origin + np.where(s > 0.0, s, np.nan)[:, None] * along - centre
        return at @ np.cross([0.0, 1.0, 0.0], normal), at[:, 1]


def _over(value, above, covered):
    """What is above covers a share; where it has no image, none."""
    return np.where(np.isfinite(covered), value + (above - value) * covered, value)
