"""Validated input of the solvers: b images of the same n object points."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask, as_numbers
from eposit.camera import BEARINGS, Camera
from eposit.refine.weights import LEAST_SIGMA, MOST_SIGMA, whitening
from eposit.solution import OK, STATUSES, Status


@dataclass(frozen=True, slots=True)
class Problem:
    """One object and b images of it."""

    points_in_obj: Array  # (n, 3)
    points_px: Array  # (b, n, 2), zeros where a row is not usable
    camera: Camera
    status: NDArray[np.int8]  # (b,) places in STATUSES, OK where the row is usable so far
    weights: Array  # (2, 2, n)
    absolute: bool  # whether the covariance is absolute: sigma_px was given

    def part(self, rows: slice) -> Problem:
        """Some of the images; what is marked there is marked here."""
        return replace(self, points_px=self.points_px[rows], status=self.status[rows])

    def chunks(self, size: int) -> Iterator[Problem]:
        """The batch in pieces whose arrays stay in the cache; an empty batch is one piece."""
        for i in range(0, max(1, len(self.status)), size):
            yield self.part(slice(i, i + size))

    @property
    def uv(self) -> tuple[Array, Array]:
        """Image coordinates u, v, each (n, b), px."""
        return self.points_px[..., 0].T, self.points_px[..., 1].T


def as_camera(camera: object) -> Camera:
    """A camera as it is.

    Raises:
        ValueError: it is another thing.
    """
    if not isinstance(camera, Camera):
        raise ValueError(f"camera is a {type(camera).__name__}; it must be an eposit.Camera")
    return camera


def as_object(points_in_obj: ArrayLike) -> Array:
    """(n, 3) object points.

    Raises:
        ValueError: another shape, fewer than four points, or non-finite ones.
    """
    obj = as_numbers(points_in_obj, "points_in_obj")
    if obj.ndim != 2 or obj.shape[1] != 3:
        raise ValueError(f"points_in_obj has shape {obj.shape}; it must be (n, 3)")
    if len(obj) < 4:
        raise ValueError(f"points_in_obj has {len(obj)} points; a pose needs at least 4")
    squares = np.vdot(obj, obj)  # several times as fast as looking at each, without a warning
    if not math.isfinite(squares) and not np.all(np.isfinite(obj)):
        raise ValueError("points_in_obj has NaN or infinite coordinates; give finite ones")
    return obj


def as_pixels(points_px: ArrayLike, n: int) -> tuple[Array, bool]:
    """(b, n, 2) image points, NaN where masked, and whether they were given as a single image.

    Raises:
        ValueError: another shape.
    """
    pixels = as_numbers(points_px, "points_px")
    if pixels.ndim not in (2, 3) or pixels.shape[-2:] != (n, 2):
        raise ValueError(f"points_px has shape {pixels.shape}; it must be ({n}, 2) or (b, {n}, 2)")
    return (pixels[None], True) if pixels.ndim == 2 else (pixels, False)


def as_bearings(rays: ArrayLike, points_px: ArrayLike | None, camera: Camera | None, n: int) -> tuple[Array, Camera]:
    """Bearing vectors, (n, 3) or (b, n, 3), as the image points of BEARINGS, whose residuals are angles, rad.

    Its lens is stereographic: it sees all directions but the backward one, and has one scale at each point.

    Raises:
        ValueError: another shape, or image points or a camera as well.
    """
    if points_px is not None or camera is not None:
        raise ValueError("solve was given rays and points_px or a camera; give either rays, or points_px and camera")
    vectors = as_numbers(rays, "rays")
    if vectors.ndim not in (2, 3) or vectors.shape[-2:] != (n, 3):
        raise ValueError(f"rays has shape {vectors.shape}; it must be ({n}, 3) or (b, {n}, 3)")
    return BEARINGS.project(vectors), BEARINGS


EQUAL_WEIGHTS = np.array([[1.0, 0.0, 1.0]])


def as_weights(sigma_px: ArrayLike | None, n: int) -> tuple[Array, float]:
    """Inverse covariances (m, 3) in px^-2 (xx, xy, yy), m = n or 1 for all points, and the variance to divide them by.

    The variance is 0 where sigma is unknown.

    Raises:
        ValueError: a sigma of another shape, or one that is not positive.
    """
    if sigma_px is None:
        return EQUAL_WEIGHTS, 0.0
    if isinstance(sigma_px, float | int) and LEAST_SIGMA < sigma_px < MOST_SIGMA:
        return EQUAL_WEIGHTS, float(sigma_px) ** 2
    sigma = as_numbers(sigma_px, "sigma_px")
    factor = whitening(sigma, n)
    if sigma.ndim == 0:
        return EQUAL_WEIGHTS, float(sigma) ** 2
    return inverse_covariances(factor), 1.0


def inverse_covariances(factor: Array) -> Array:
    """(n, 3) W^T W, as (xx, xy, yy), of (2, 2, n) matrices W as `whitening` gives them."""
    (a, b), (c, d) = factor
    return np.stack((a * a + c * c, a * b + c * d, b * b + d * d), axis=-1)


def validate(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, sigma_px: ArrayLike | None = None
) -> tuple[Problem, bool]:
    """The problem, and whether it was given as a single image.

    Raises:
        ValueError: wrong shapes, fewer than four points, non-finite object points, an unusable sigma, or a camera that
            is none.
    """
    obj = as_object(points_in_obj)
    pixels, single = as_pixels(points_px, len(obj))
    status = np.full(len(pixels), OK, np.int8)
    if not np.all(np.isfinite(pixels)):
        lost = ~np.all(np.isfinite(pixels), axis=(1, 2))
        mark(status, lost, Status.NON_FINITE)
        pixels = np.where(lost[:, None, None], 0.0, pixels)
    weights = whitening(None if sigma_px is None else as_numbers(sigma_px, "sigma_px"), len(obj))
    return Problem(obj, pixels, as_camera(camera), status, weights, sigma_px is not None), single


def mark(status: NDArray[np.int8], failed: Mask, reason: Status) -> None:
    """Give rows that are still OK a reason to fail; the first reason stays."""
    if np.any(failed):
        status[failed & (status == OK)] = np.flatnonzero(reason == STATUSES)[0]
