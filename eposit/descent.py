"""Poses of another method taken to the minimum of the reprojection error near them."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from eposit.compiled.layout import LINEAR_RESULT
from eposit.pose import Pose
from eposit.problem import Problem, inverse_covariances, workspace
from eposit.results import solve_batch
from eposit.solution import Solution


def to_minimum(problem: Problem, start: Pose) -> Solution:
    """From b poses, R (b, 3, 3) and t (b, 3); NaN where there is none: NOT_CONVERGED. No covariance is stated."""
    from eposit.compiled.machine_code import native
    from eposit.compiled.refine import refine_poses

    n, w = len(problem.points_in_obj), workspace(problem.camera, len(problem.points_in_obj))
    obj, weights = np.ascontiguousarray(problem.points_in_obj), inverse_covariances(problem.weights)
    pixels = np.ascontiguousarray(problem.points_px)
    starts = np.ascontiguousarray(np.hstack((start.R.reshape(-1, 9), start.t)))  # hstack keeps the order of a transpose

    def run(out: Array, first: int, stop: int) -> None:
        native(refine_poses)(
            w.ctypes.data, n, obj.ctypes.data, pixels.ctypes.data, weights.ctypes.data, n, len(pixels), first, stop,
            starts.ctypes.data, out.ctypes.data,
        )  # fmt: skip

    return solve_batch(run, (len(pixels), n), LINEAR_RESULT, 1.0)
