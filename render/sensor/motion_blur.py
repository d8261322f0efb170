"""The blur of an image that moves evenly while the shutter is open: the mean over the way that each pixel goes."""

from __future__ import annotations

import cv2
import numpy as np

from eposit.arrays import Array
from render.region import Image
from render.sensor.motion import Exposure, at_pixels
from render.targets.image_region import Region

MIN_MOTION_PX = 0.05  # less motion would widen a point spread of 0.7 px by less than 0.03 percent
SHORT_MOTION_PX = 0.5  # up to here nine weights with the right moments are within half a grey level of the mean
NODE_SPACING_PX = 0.7  # about this far apart, at most, are the moments of a longer motion


def motion_blurred(light: Image, exposure: Exposure, region: Region, spread_px: float) -> Image:
    """The mean over the exposure of the light around the board, which moves with it.

    region: of the picture where the board is. spread_px: how far the lens has spread its light before. That comes
    first, though the light moves before: over its few pixels the motion is the same, so the order does not matter, and
    spread light can be interpolated with next to no further blur.
    """
    longest = _longest(exposure.displacement(region))
    if longest < MIN_MOTION_PX:
        return light
    height, width = light.shape
    region = region.grown(int(np.ceil(longest + spread_px)), width, height)
    displacement = exposure.displacement(region)
    longest = _longest(displacement)
    dx, dy = at_pixels(displacement, region.width, region.height)
    part, blurred = light[region.pixels], light.copy()
    short = longest <= SHORT_MOTION_PX
    blurred[region.pixels] = _short_motion(part, dx, dy) if short else _long_motion(part, dx, dy, longest)
    return blurred


def _short_motion(part: Image, dx: Image, dy: Image) -> Image:
    """Blur by nine weights with the moments of an even motion along d: mean 0, variance d^2 / 12."""
    kernels = (
        (dx * dx, [[0, 0, 0], [1, -2, 1], [0, 0, 0]]),
        (dy * dy, [[0, 1, 0], [0, -2, 0], [0, 1, 0]]),
        (dx * dy, [[0.5, 0, -0.5], [0, 0, 0], [-0.5, 0, 0.5]]),
    )
    total = part.copy()
    for variance, second_difference in kernels:
        kernel = np.array(second_difference, np.float32) / np.float32(24.0)
        total += variance * cv2.filter2D(part, -1, kernel, borderType=cv2.BORDER_REPLICATE)
    return total


def _long_motion(part: Image, dx: Image, dy: Image, longest: float) -> Image:
    """The mean of the light at the moments of Gauss and Legendre, which lie symmetrically about mid-exposure.

    It is interpolated by Lanczos over 8 x 8 pixels.
    """
    columns, rows = np.arange(part.shape[1], dtype=np.float32), np.arange(part.shape[0], dtype=np.float32)[:, None]
    total = np.zeros_like(part)
    moments, weights = np.polynomial.legendre.leggauss(1 + int(np.ceil(longest / NODE_SPACING_PX)))
    for moment, weight in zip(moments, weights, strict=True):
        back = np.float32(-0.5 * moment)
        source = columns + back * dx, rows + back * dy
        moved = cv2.remap(part, *source, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REPLICATE)
        total += np.float32(0.5 * weight) * moved
    return total


def _longest(displacement: Array) -> float:
    return float(np.max(np.hypot(displacement[..., 0], displacement[..., 1])))
