"""The pose of one image whose points have errors in common: least squares with their joint covariance."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from eposit.camera import Camera
from eposit.pose import Pose, rotation_from_vector
from eposit.refine.reprojection import Observations, residuals_and_slopes
from eposit.refine.weights import whitening

MOST_STEPS = 20
STOP = 1e-6  # step, in standard deviations of the pose, at which it has converged; the step is still made
LEAST_SINGULAR = 1e-8  # of the factor, relative: along directions below it the points state no error, nor do they count


def refine_jointly(
    points_in_obj: Array, points_px: Array, camera: Camera, factor: Array, start: Pose
) -> tuple[Pose, Array] | None:
    """The pose and its covariance (6, 6), by Gauss-Newton steps from a pose near by; None if they do not converge.

    points_in_obj: (n, 3). points_px: (n, 2). factor: (n, 2, k) px, so that the covariance of points i and j is
    factor[i] @ factor[j].T. It may have less rank than the points have coordinates, as where they lie on a smooth map
    of few parameters: their residuals count along the directions in which they can err. covariance: a rotation vector
    on the left in the camera frame (rad), then t.

    Source:
        Rao 1973, Linear Statistical Inference and its Applications, 4i: least squares with a singular covariance.
    """
    n = len(points_in_obj)
    whitener = np.linalg.pinv(factor.reshape(2 * n, -1), rcond=LEAST_SINGULAR)
    view = Observations.of(camera, points_in_obj, points_px[None], whitening(None, n))
    pose = Pose(start.R, start.t)
    for _ in range(MOST_STEPS):
        with np.errstate(all="ignore"):
            missed, rows = residuals_and_slopes(view, np.ascontiguousarray(pose.R)[..., None], pose.t[:, None])
            slopes, residuals = whitener @ rows[..., 0], whitener @ missed.ravel()
        size = np.linalg.norm(slopes, axis=0)
        if not np.all((size > 0.0) & (size < np.inf)) or np.linalg.matrix_rank(slopes / size) < 6:
            return None
        normal = slopes.T @ slopes
        move = -np.linalg.solve(normal, slopes.T @ residuals)
        pose = Pose(rotation_from_vector(move[:3]) @ pose.R, pose.t + move[3:])
        if move @ normal @ move < STOP**2:
            return pose, np.linalg.inv(normal)
    return None
