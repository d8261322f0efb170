"""A central camera: a lens law, focal lengths and a principal point."""

from __future__ import annotations

import math
import numbers
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike

from eposit.arrays import Array, Mask, as_numbers, shown
from eposit.lens import get_lens
from eposit.lens_law import Lens

MOST = 1e150  # of a camera's numbers: their squares are numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A central camera. Axes x right, y down, z forward; pixel centres at integer coordinates, as in OpenCV.

    Raises:
        ValueError: unknown lens, wrong coefficients, or a focal length or image size that is not positive.
    """

    lens: str  # one of eposit.LENS_NAMES
    fx: float  # focal length along x, px
    fy: float  # focal length along y, px
    cx: float  # principal point, px
    cy: float  # principal point, px
    width: int  # image width, px
    height: int  # image height, px
    coefficients: tuple[float, ...] = ()  # in the order of eposit.COEFFICIENTS, in any shape; none for the paper's

    def __post_init__(self) -> None:
        coefficients = as_numbers(self.coefficients, "camera coefficients").ravel().tolist()
        object.__setattr__(self, "coefficients", tuple(coefficients))
        if not _is_text(self.lens):
            raise ValueError(f"camera lens is a {type(self.lens).__name__}; it must be one of eposit.LENS_NAMES")
        for name in ("fx", "fy", "width", "height"):
            value = getattr(self, name)
            if not (_is_real(value) and math.isfinite(value) and value > 0):
                raise ValueError(f"camera {name} is {shown(value)}; it must be a positive number of pixels")
        for name in ("cx", "cy"):
            value = getattr(self, name)
            if not (_is_real(value) and math.isfinite(value)):
                raise ValueError(f"camera {name} is {shown(value)}; it must be a finite number of pixels")
        get_lens(self.lens, self.coefficients)

    @property
    def law(self) -> Lens:
        """The lens law behind the name."""
        return get_lens(self.lens, self.coefficients)

    def matrix(self) -> Array:
        """(3, 3) intrinsic matrix, px."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def replace(self, **changes: Any) -> Self:
        """A camera with some fields changed, each of its own type: those are stated once, above."""
        return replace(self, **changes)

    def project(self, points_in_cam: ArrayLike) -> Array:
        """(..., 3) points, any unit, to (..., 2) px; NaN rows where the lens cannot see.

        Raises:
            ValueError: the last axis is not 3.
        Source:
            Paper, equations 1 to 5; `eposit.calibrated_lens` for lenses with coefficients.
        """
        points = _last_axis(points_in_cam, 3, "points_in_cam")
        x, y, z = np.moveaxis(points, -1, 0)
        side = np.hypot(x, y)
        radius = self.law.rho(_seen_angle(side, z))
        on_axis = side == 0.0
        with np.errstate(over="ignore", invalid="ignore"):  # of points of the largest and the smallest numbers
            scale = np.where(on_axis, 0.0, radius / np.where(on_axis, 1.0, side)) + 0.0 * radius
            return np.stack((self.fx * x * scale + self.cx, self.fy * y * scale + self.cy), axis=-1)

    def sees(self, points_in_cam: ArrayLike) -> Mask:
        """(..., 3) points to a (...) mask: the lens gives the point an image (inside the picture or not)."""
        points = _last_axis(points_in_cam, 3, "points_in_cam")
        x, y, z = np.moveaxis(points, -1, 0)
        return self.law.sees(_seen_angle(np.hypot(x, y), z))

    def bearing(self, points_px: ArrayLike) -> Array:
        """(..., 2) px to (..., 3) unit vectors in the camera frame; NaN rows where no ray reaches the pixel."""
        pixels = _last_axis(points_px, 2, "points_px")
        x = (pixels[..., 0] - self.cx) / self.fx
        y = (pixels[..., 1] - self.cy) / self.fy
        radius = np.hypot(x, y)
        theta = self.law.theta(radius)
        on_axis = radius == 0.0
        scale = np.where(on_axis, 1.0, np.sin(theta) / np.where(on_axis, 1.0, radius))
        return np.stack((x * scale, y * scale, np.cos(theta)), axis=-1)

    def contains(self, points_px: ArrayLike) -> Mask:
        """(..., 2) px to a (...) mask: the point lies on the picture's area. NaN does not."""
        pixels = _last_axis(points_px, 2, "points_px")
        u, v = pixels[..., 0], pixels[..., 1]
        return (u >= -0.5) & (u <= self.width - 0.5) & (v >= -0.5) & (v <= self.height - 0.5)


def _is_text(value: object) -> bool:
    return isinstance(value, str)


def _is_real(value: object) -> bool:
    """Whether a value is one real number, of whatever package, that float64 can hold."""
    if not isinstance(value, numbers.Real):
        return False
    try:
        return abs(float(value)) <= MOST
    except OverflowError:
        return False  # a whole number of hundreds of digits


def _seen_angle(side: Array, z: Array) -> Array:
    """Incidence angle, rad; NaN for the camera centre and on the backward axis, where no direction is defined."""
    return np.where((side == 0.0) & (z <= 0.0), np.nan, np.arctan2(side, z))


def _last_axis(values: ArrayLike, size: int, name: str) -> Array:
    array = as_numbers(values, name)
    if array.ndim == 0 or array.shape[-1] != size:
        raise ValueError(f"{name} has shape {array.shape}; its last axis must have length {size}")
    return array


# The image of bearing vectors, in which distances near a point are angles but for the scale there, 2 / (1 + cos theta).
BEARINGS = Camera(lens="stereographic", fx=1.0, fy=1.0, cx=0.0, cy=0.0, width=1, height=1)
