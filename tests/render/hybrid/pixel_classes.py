"""Which pixels of a picture show what of the target."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from render.analytic.device_target import shaded_target
from render.analytic.integrate import integrate_shaded
from render.analytic.rays import device_camera
from render.hybrid.texels import shade_reach
from render.targets.chessboard import Chessboard

NEAR_SHARE = 1.5  # of the circle's radius: where its shade changes from pixel to pixel
FULL = 0.9999


def pixel_classes(target: Chessboard, camera, cam_from_obj, region):
    """Name to mask of a region's pixels, and (height, width) the reflectance that they see.

    white, black, edge: the board away from the circle; shade: the board around it; disc: the circle alone.
    """
    device, reach = device_camera(camera, cam_from_obj), shade_reach(target)

    def seen(board, board_light, disc_light):
        shaded = shaded_target(board, np.full((2, 2), board_light), disc_light, reach)
        return integrate_shaded(shaded, device, camera, region, 64, 0.0)

    even = replace(target, white=1.0, black=1.0, circle=1.0)
    wide = replace(even, circle_radius_mm=min(NEAR_SHARE * target.circle_radius_mm, 0.45 * target.square_mm))
    filled, disc = seen(even, 1.0, 1.0), seen(even, 0.0, 1.0)
    near, reflectance = seen(wide, 0.0, 1.0) > 0.0, seen(target, 1.0, 0.0)
    board = (filled > FULL) & ~near
    low, high = target.black + 1e-3, target.white - 1e-3
    return {
        "white": board & (reflectance >= high),
        "black": board & (reflectance <= low),
        "edge": board & (reflectance > low) & (reflectance < high),
        "shade": near & (filled > FULL) & (disc < FULL),
        "disc": disc >= FULL,
    }, reflectance
