"""Validated input of the solvers: b images of the same n object points."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask
from eposit.camera import Camera
from eposit.refine.weights import whitening
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


def validate(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, sigma_px: ArrayLike | None = None
) -> tuple[Problem, bool]:
    """The problem, and whether it was given as a single image.

    Raises:
        ValueError: wrong shapes, fewer than four points, non-finite object points, or an unusable sigma.
    """
    obj = np.asarray(points_in_obj, dtype=np.float64)
    pixels = np.asarray(points_px, dtype=np.float64)
    if obj.ndim != 2 or obj.shape[1] != 3:
        raise ValueError(f"points_in_obj has shape {obj.shape}; it must be (n, 3)")
    if len(obj) < 4:
        raise ValueError(f"points_in_obj has {len(obj)} points; a pose needs at least 4")
    if not np.all(np.isfinite(obj)):
        raise ValueError("points_in_obj has NaN or infinite coordinates; give finite ones")
    if pixels.ndim not in (2, 3) or pixels.shape[-2:] != (len(obj), 2):
        raise ValueError(f"points_px has shape {pixels.shape}; it must be ({len(obj)}, 2) or (b, {len(obj)}, 2)")
    single = pixels.ndim == 2
    pixels = pixels[None] if single else pixels
    status = np.full(len(pixels), OK, np.int8)
    if not np.all(np.isfinite(pixels)):
        lost = ~np.all(np.isfinite(pixels), axis=(1, 2))
        mark(status, lost, Status.NON_FINITE)
        pixels = np.where(lost[:, None, None], 0.0, pixels)
    weights = whitening(None if sigma_px is None else np.asarray(sigma_px, dtype=np.float64), len(obj))
    return Problem(obj, pixels, camera, status, weights, sigma_px is not None), single


def mark(status: NDArray[np.int8], failed: Mask, reason: Status) -> None:
    """Give rows that are still OK a reason to fail; the first reason stays."""
    if np.any(failed):
        status[failed & (status == OK)] = np.flatnonzero(reason == STATUSES)[0]
