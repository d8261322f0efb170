"""What pixels see of a target apart from its light: how much of each is the target, and how much of that is white.

The closed form of `cells` under a light of radiance 1 everywhere. What a fit to a picture compares with it, and then
finds the light itself.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from render import backend
from render.analytic.board_reflectance import SMOOTH
from render.analytic.cells import sample_cells
from render.analytic.device_target import DeviceTarget, shaded_target
from render.analytic.rays import DeviceCamera, device_camera
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region

CELL_SIDE = 4  # cells along each side of a pixel that an edge crosses: within 0.05 of 255 levels of 16
Shares = NDArray[np.float32]


class PixelShares(NamedTuple):
    """(height, width) shares of pixels of a region, box filter, 0 to 1."""

    white: Shares  # of the pixel that is white; the circle counts as nearly black
    target: Shares  # of the pixel that is target at all


def pixel_shares(target: Chessboard, camera: Camera, cam_from_obj: Pose, region: Region) -> PixelShares:
    """What the pixels of a region see of the target under any light that is even over a pixel."""
    device = _device_target(target), device_camera(camera, cam_from_obj)
    rows, columns = np.divmod(np.arange(region.width * region.height, dtype=np.int64), region.width)
    x, y = (columns + region.x).astype(np.float32), (rows + region.y).astype(np.float32)
    reflected, filled, edges = _sampled(device, x, y, 1.0)
    crossed = np.flatnonzero(edges != SMOOTH)
    offsets = ((np.arange(CELL_SIDE) + 0.5) / CELL_SIDE - 0.5).astype(np.float32)
    inner_x, inner_y = np.tile(offsets, CELL_SIDE), np.repeat(offsets, CELL_SIDE)
    if len(crossed):
        fine_x, fine_y = (at[crossed, None] + inner for at, inner in ((x, inner_x), (y, inner_y)))
        fine = _sampled(device, fine_x.ravel(), fine_y.ravel(), 1.0 / CELL_SIDE)
        reflected[crossed], filled[crossed] = (part.reshape(len(crossed), -1).mean(axis=1) for part in fine[:2])
    white = (reflected - np.float32(target.black) * filled) / np.float32(target.white - target.black)
    shape = region.height, region.width
    return PixelShares(white.reshape(shape).astype(np.float32, copy=False), filled.reshape(shape))


def _sampled(
    device: tuple[DeviceTarget, DeviceCamera], x_px: Shares, y_px: Shares, size: float
) -> tuple[Shares, Shares, NDArray[np.uint32]]:
    """Mean reflectance of cells, the target's share of them, and the edges that cross them."""
    mi, dr = backend.load(), backend.jit()
    found = sample_cells(*device, mi.Float(x_px), mi.Float(y_px), dr.opaque(mi.Float, size))
    dr.eval(found.radiance, found.filled, found.edges)
    return np.array(found.radiance), np.array(found.filled), np.array(found.edges)


@functools.lru_cache(maxsize=4)
def _device_target(target: Chessboard) -> DeviceTarget:
    """The target uploaded with a map of the light that is 1 everywhere and without shadows."""
    return shaded_target(target, np.ones((2, 2)), 1.0, target.circle_radius_mm)
