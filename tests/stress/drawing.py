"""Pictures by brute force: each pixel that is not of one grey is drawn from cells, then point spread, then the mean."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.ndimage import maximum_filter, minimum_filter

COARSE = 3.0  # px that the first look averages over, so that no edge falls between its places
SAME = 1e-9


@dataclass(frozen=True)
class Spread:
    """A symmetric point spread."""

    gaussian: float = 0.0  # standard deviation, px
    disc: float = 0.0  # radius of a defocus disc, px
    streak: float = 0.0  # length of a straight motion, px
    streak_deg: float = 25.0

    @property
    def reach(self):
        """How far it carries light, px."""
        return int(np.ceil(5.0 * self.gaussian + self.disc + self.streak / 2.0)) + 1


def draw(scene, width, height, spread=Spread(), finer=4):
    """(height, width) linear radiance; `finer` cells to a pixel along each side, each soft by its own size."""
    border = spread.reach
    fine = _fine(scene, width, height, border, finer)
    fine = _spread(fine, spread, finer)
    rows, columns = height + 2 * border, width + 2 * border
    whole = fine.reshape(rows, finer, columns, finer).mean(axis=(1, 3))
    return whole[border : border + height, border : border + width].astype(np.float64)


def _fine(scene, width, height, border, finer):
    x, y = np.meshgrid(np.arange(-border, width + border) * 1.0, np.arange(-border, height + border) * 1.0)
    slopes = scene.slopes(x.ravel(), y.ravel()).reshape(4, *x.shape)
    first = scene.grey(x.ravel(), y.ravel(), COARSE, slopes.reshape(4, -1)).reshape(x.shape)
    busy = maximum_filter(first, 3) - minimum_filter(first, 3) > SAME
    fine = np.repeat(np.repeat(first.astype(np.float32), finer, axis=0), finer, axis=1)
    blocks = fine.reshape(x.shape[0], finer, x.shape[1], finer)
    rows, columns = np.nonzero(busy)
    offsets = (np.arange(finer) + 0.5) / finer - 0.5
    for part in np.array_split(np.arange(len(rows)), max(1, len(rows) * finer**2 // 2_000_000)):
        r, c = rows[part], columns[part]
        near = slopes[:, r, c]
        for i, down in enumerate(offsets):
            for j, across in enumerate(offsets):
                blocks[r, i, c, j] = scene.grey(x[r, c] + across, y[r, c] + down, 1.0 / finer, near)
    return fine


def _spread(fine, spread, finer):
    if spread.gaussian > 0.0:
        size = 2 * int(np.ceil(5.0 * spread.gaussian * finer)) + 1
        fine = cv2.GaussianBlur(fine, (size, size), spread.gaussian * finer, borderType=cv2.BORDER_REPLICATE)
    for kernel in (_disc(spread.disc * finer), _streak(spread.streak * finer, spread.streak_deg)):
        if kernel is not None:
            fine = cv2.filter2D(fine, -1, kernel, borderType=cv2.BORDER_REPLICATE)
    return fine


def _disc(radius):
    if radius == 0.0:
        return None
    n = int(np.ceil(radius)) + 1
    y, x = np.mgrid[-n : n + 1, -n : n + 1]
    kernel = np.clip(0.5 + radius - np.hypot(x, y), 0.0, 1.0)
    return (kernel / kernel.sum()).astype(np.float32)


def _streak(length, deg):
    if length == 0.0:
        return None
    n = int(np.ceil(length / 2.0)) + 1
    y, x = np.mgrid[-n : n + 1, -n : n + 1]
    c, s = np.cos(np.radians(deg)), np.sin(np.radians(deg))
    along, aside = np.abs(c * x + s * y), np.abs(c * y - s * x)
    kernel = np.clip(0.5 + length / 2.0 - along, 0.0, 1.0) * np.clip(1.0 - aside, 0.0, 1.0)
    return (kernel / kernel.sum()).astype(np.float32)
