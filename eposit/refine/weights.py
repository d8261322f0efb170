"""Maximum-likelihood refinement: Gauss-Newton on the reprojection error, and the covariance at its minimum.

The pose changes by a rotation vector applied on the left in the camera frame (rad), then a translation: the same
six numbers, in the same order, as the covariance. Poses here have the problems first, R (b, 3, 3) and t (b, 3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from eposit.camera import Camera
from eposit.pose import PoseBatch
from eposit.refine import ldl6
from eposit.refine.minimise import descend
from eposit.refine.reprojection import Observations, equations


@dataclass(frozen=True, slots=True)
class Refined:
    """Poses at a local minimum of the weighted reprojection error."""

    R: Array  # (b, 3, 3)
    t: Array  # (b, 3)
    cost: Array  # (b,) sum of squared residuals: px^2, or without unit where they were divided by sigma
    steps: NDArray[np.int64]  # (b,)
    converged: Mask  # (b,)


def whitening(sigma_px: Array | None, n: int) -> Array:
    """(2, 2, n) matrices W with W^T W = inverse covariance; the identity for None.

    sigma_px: None, a scalar, (n,) standard deviations, or (n, 2, 2) covariances, px and px^2.

    Raises:
        ValueError: another shape, or a value that is not positive.
    """
    if sigma_px is None:
        return np.repeat(np.eye(2)[:, :, None], n, axis=2)
    sigma = np.asarray(sigma_px, dtype=np.float64)
    if sigma.shape in ((), (n,)):
        if not (np.all(np.isfinite(sigma)) and np.all(sigma > 0.0)):
            raise ValueError("sigma_px has values that are not positive; give standard deviations above 0 px")
        return np.eye(2)[:, :, None] / np.broadcast_to(sigma, n)
    if sigma.shape != (n, 2, 2):
        raise ValueError(f"sigma_px has shape {sigma.shape}; it must be a scalar, ({n},) or ({n}, 2, 2)")
    try:
        lower = np.linalg.cholesky(sigma)
    except np.linalg.LinAlgError:
        raise ValueError("sigma_px has a covariance that is not positive definite; check the (2, 2) blocks") from None
    return np.linalg.inv(lower).transpose(1, 2, 0)


def refine_poses(
    camera: Camera, points_in_obj: Array, u: Array, v: Array, R: Array, t: Array, weights: Array
) -> Refined:
    """Poses at the minima of the cost next to the given ones.

    points_in_obj: (n, 3). u, v: (n, b) px. R, t: (b, 3, 3), (b, 3); NaN rows stay NaN. weights: (2, 2, n).
    """
    view = Observations.of(camera, points_in_obj, np.stack((u.T, v.T), axis=-1), weights)
    b = len(t)
    found = descend(view, PoseBatch(*_columns(R, t), np.zeros(b, np.int64), np.ones(b, bool)))
    poses = found.poses
    return Refined(poses.R.transpose(2, 0, 1), poses.t.T, found.cost, poses.iterations, poses.converged)


def normal_equations(
    camera: Camera, points_in_obj: Array, u: Array, v: Array, R: Array, t: Array, weights: Array
) -> tuple[Array, Array]:
    """(b, 6, 6) information matrix J^T J and (b, 6) gradient J^T r of the weighted residuals."""
    view = Observations.of(camera, points_in_obj, np.stack((u.T, v.T), axis=-1), weights)
    with np.errstate(all="ignore"):
        model = equations(view, *_columns(R, t))
    normal = model.normal.transpose(2, 0, 1).copy()
    rows, columns = np.tril_indices(6, -1)
    normal[:, rows, columns] = normal[:, columns, rows]
    return normal, model.gradient.T


def covariance(normal: Array) -> Array:
    """(b, 6, 6) inverse of the information matrix; NaN where it has no inverse."""
    return ldl6.inverse(ldl6.factorise(np.ascontiguousarray(normal.transpose(1, 2, 0)))).transpose(2, 0, 1)


def _columns(R: Array, t: Array) -> tuple[Array, Array]:
    return np.ascontiguousarray(R.transpose(1, 2, 0)), np.ascontiguousarray(t.T)
