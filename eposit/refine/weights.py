"""Weights of the image points, and the information matrix and covariance of a pose.

Poses change by a rotation vector applied on the left in the camera frame (rad), then a translation: the same six
numbers, in the same order, as the covariance. Poses here have the problems first, R (b, 3, 3) and t (b, 3).
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array, as_numbers
from eposit.camera import Camera
from eposit.refine import ldl6
from eposit.refine.reprojection import Observations, equations

LEAST_SIGMA, MOST_SIGMA = 1e-75, 1e75  # px: its square and the inverse of that are numbers


def whitening(sigma_px: Array | None, n: int) -> Array:
    """(2, 2, n) matrices W with W^T W = inverse covariance; the identity for None.

    sigma_px: None, a scalar, (n,) standard deviations, or (n, 2, 2) covariances, px and px^2.

    Raises:
        ValueError: another shape, or a value that is not positive.
    """
    if sigma_px is None:
        return np.repeat(np.eye(2)[:, :, None], n, axis=2)
    sigma = as_numbers(sigma_px, "sigma_px")
    if sigma.shape in ((), (n,)):
        if not np.all((sigma > LEAST_SIGMA) & (sigma < MOST_SIGMA)):
            raise ValueError(
                "sigma_px has values that are not positive, or out of all bounds; give standard deviations above 0 px"
            )
        return np.eye(2)[:, :, None] / np.broadcast_to(sigma, n)
    if sigma.shape != (n, 2, 2):
        raise ValueError(f"sigma_px has shape {sigma.shape}; it must be a scalar, ({n},) or ({n}, 2, 2)")
    try:
        if not np.all(np.isfinite(sigma)):
            raise np.linalg.LinAlgError
        lower = np.linalg.cholesky(sigma)
    except np.linalg.LinAlgError:
        raise ValueError("sigma_px has a covariance that is not positive definite; check the (2, 2) blocks") from None
    return np.linalg.inv(lower).transpose(1, 2, 0)


def normal_equations(
    camera: Camera, points_in_obj: Array, u: Array, v: Array, R: Array, t: Array, weights: Array
) -> tuple[Array, Array]:
    """(b, 6, 6) information matrix J^T J and (b, 6) gradient J^T r of the weighted residuals."""
    view = Observations.of(camera, points_in_obj, np.stack((u.T, v.T), axis=-1), weights)
    with np.errstate(all="ignore"):
        model = equations(view, np.ascontiguousarray(R.transpose(1, 2, 0)), np.ascontiguousarray(t.T))
    normal = model.normal.transpose(2, 0, 1).copy()
    rows, columns = np.tril_indices(6, -1)
    normal[:, rows, columns] = normal[:, columns, rows]
    return normal, model.gradient.T


def covariance(normal: Array) -> Array:
    """(b, 6, 6) inverse of the information matrix; NaN where it has no inverse."""
    return ldl6.inverse(ldl6.factorise(np.ascontiguousarray(normal.transpose(1, 2, 0)))).transpose(2, 0, 1)
