"""The lens's image circle: what share of each pixel the lens sees."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from eposit import Camera
from render import backend
from render.device import DeviceFloat

EDGE_SAMPLES = 16  # subpixels along each side of a pixel that the circle's rim crosses


@functools.lru_cache(maxsize=8)
def lens_coverage(camera: Camera) -> NDArray[np.float32]:
    """(height, width) share of each pixel that the lens sees: 1 inside the image circle, 0 outside."""
    circle_radius = camera.law.rho_max
    corner = np.hypot((camera.width + abs(camera.cx)) / camera.fx, (camera.height + abs(camera.cy)) / camera.fy)
    if not np.isfinite(circle_radius) or circle_radius >= corner:
        return np.ones((camera.height, camera.width), np.float32)
    x, y = (np.arange(camera.width) - camera.cx) / camera.fx, (np.arange(camera.height) - camera.cy) / camera.fy
    radius = np.hypot(x[None], y[:, None])
    coverage = (radius <= circle_radius).astype(np.float32)
    pixel = 1.0 / min(camera.fx, camera.fy)
    rows, columns = np.nonzero(np.abs(radius - circle_radius) <= pixel)
    sub = (np.arange(EDGE_SAMPLES) + 0.5) / EDGE_SAMPLES - 0.5
    fine_x = x[columns, None, None] + sub[None, None, :] / camera.fx
    fine_y = y[rows, None, None] + sub[None, :, None] / camera.fy
    coverage[rows, columns] = np.mean(np.hypot(fine_x, fine_y) <= circle_radius, axis=(1, 2))
    return coverage


@functools.lru_cache(maxsize=8)
def device_coverage(camera: Camera) -> DeviceFloat:
    """`lens_coverage`, row by row, as a Dr.Jit array."""
    return backend.load().Float(lens_coverage(camera).ravel())
