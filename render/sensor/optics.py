"""What a lens does to light besides its projection: the disc of defocus and the loss towards corners and rim."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from eposit import Camera
from eposit.arrays import Array


@functools.lru_cache(maxsize=4)
def disc_kernel(radius: float) -> NDArray[np.float32]:
    """(2 k + 1, 2 k + 1) share of a disc's area in each pixel, exact; the disc lies on the middle of the middle pixel.

    radius: px, above 0.
    """
    reach = int(np.ceil(radius - 0.5)) if radius > 0.5 else 0
    border = np.arange(-reach, reach + 2) - 0.5
    area = _quarter_plane_area(np.clip(border / radius, -1.0, 1.0))
    shares = np.diff(np.diff(area, axis=0), axis=1)
    return (shares / shares.sum()).astype(np.float32)


def _quarter_plane_area(at: Array) -> Array:
    """(n, n) area of the unit disc where x <= at[i] and y <= at[j], each in [-1, 1]."""
    a, b = np.meshgrid(at, at, indexing="ij")

    def below(x: Array) -> Array:
        """Integral of sqrt(1 - x^2) from -1."""
        return 0.5 * (x * np.sqrt(np.maximum(0.0, 1.0 - x * x)) + np.arcsin(x)) + 0.25 * np.pi

    # At x the disc spans y from -s to s, s = sqrt(1 - x^2); below y = b that is s + min(b, s) or, for b < -s, nothing.
    half = np.sqrt(np.maximum(0.0, 1.0 - b * b))  # |x| up to which the line y = b lies inside the disc
    inner = np.clip(a, -half, half)
    across = below(inner) - below(-half) + b * (inner + half)  # where it does
    beyond = 2.0 * (below(np.minimum(a, -half)) + below(np.maximum(a, half)) - below(half))  # where b > s: all of it
    return across + np.where(b > 0.0, beyond, 0.0)


@functools.lru_cache(maxsize=4)
def vignetting_gain(width: int, height: int, loss: float) -> NDArray[np.float32]:
    """(height, width) share of light that arrives: 1 in the picture's middle, 1 - loss in its corners.

    1 / (1 + k (r / corner)^2)^2, the cos^4 law of a lens that sees its corner at the tangent sqrt k.
    """
    k = 1.0 / np.sqrt(1.0 - loss) - 1.0
    x, y = normalised_axes(width, height)
    return (1.0 / (1.0 + k * (x[None] ** 2 + y[:, None] ** 2)) ** 2).astype(np.float32)


@functools.lru_cache(maxsize=8)
def natural_falloff(camera: Camera, power: float) -> NDArray[np.float32]:
    """(height, width) share of light that a flat pupil of fixed size lets through to each pixel, 1 on the optical axis.

    A pixel sees the solid angle sin t dt dphi through a pupil that has cos t of its area, and has the area
    rho drho dphi, so that the share is cos t sin t / (rho rho') = d(sin^2 t) / d(rho^2): here the ratio of the
    differences over the pixel's width, which is finite where rho' vanishes at the rim. It is cos^4 t for a perspective
    lens, cos t cos^4(t/2) stereographic, cos t sin t / t equidistance, cos t equisolid and 1 orthogonal; past 90
    degrees the pupil shows its back, and nothing arrives.

    power: the share is raised to it.
    """
    law = camera.law
    x, y = (np.arange(camera.width) - camera.cx) / camera.fx, (np.arange(camera.height) - camera.cy) / camera.fy
    radius, half = np.hypot(x[None], y[:, None]), 0.5 / np.sqrt(camera.fx * camera.fy)
    inner, outer = np.clip((radius - half, radius + half), 0.0, law.rho_max)
    sine_squared = np.sin(law.theta(outer)) ** 2 - np.sin(law.theta(inner)) ** 2
    area = outer**2 - inner**2
    share = np.divide(sine_squared, area, out=np.zeros_like(area), where=area > 0.0) * law.slope(0.0) ** 2
    return (np.maximum(share, 0.0) ** power).astype(np.float32)


def normalised_axes(width: int, height: int) -> tuple[Array, Array]:
    """(width,) and (height,) pixels' coordinates from the picture's middle, in units of the distance to a corner."""
    x, y = np.arange(width) - 0.5 * (width - 1), np.arange(height) - 0.5 * (height - 1)
    corner = max(np.hypot(x[-1], y[-1]), 1.0)
    return x / corner, y / corner
