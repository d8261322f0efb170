"""Poses from points that share their errors, as those of a smooth map: refined with their joint covariance.

The covariance of points i and j is factor[i] @ factor[j].T, with factor (n, 2, k) px.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from eposit import Camera, Pose, Solution, Status
from eposit.arrays import Array
from eposit.refine.joint import refine_jointly
from eposit.solution import without_pose


def as_if_independent(factor: Array) -> Array:
    """(n, 2, 2) px^2 for a solver that takes points for independent: together they say as much as the points do.

    Each point's covariance times the number of coordinates for one that is independent of all, which is
    m^2 over the sum of the squared correlations of m coordinates: m where none is correlated, one where all are the
    same. Else a solver would take ten coordinates for a hundred, and call poses certain that are not.
    """
    own = factor @ factor.transpose(0, 2, 1)
    rows = (factor / np.sqrt(np.einsum("nii->ni", own))[..., None]).reshape(2 * len(factor), -1)
    return own * float(np.sum((rows @ rows.T) ** 2)) / len(rows)


def jointly(solution: Solution, points_in_obj: Array, points_px: Array, camera: Camera, factor: Array) -> Solution:
    """A batch of one, refined with the joint covariance. points_px: (1, n, 2)."""
    if str(np.asarray(solution.status)[0]) != Status.OK:
        return solution
    start = Pose(solution.cam_from_obj.R[0], solution.cam_from_obj.t[0])
    refined = refine_jointly(points_in_obj, points_px[0], camera, factor, start)
    if refined is None:
        return without_pose(solution, np.ones(1, bool), Status.NOT_CONVERGED)
    pose, covariance = refined
    missed = camera.project(pose.apply(points_in_obj)) - points_px[0]
    return replace(
        solution,
        cam_from_obj=Pose(pose.R[None], pose.t[None]),
        covariance=covariance[None],
        reprojection_rmse_px=np.sqrt(np.mean(np.sum(missed**2, axis=1)))[None],
    )
