"""Poses of another method taken to the minimum of the reprojection error near them."""

from __future__ import annotations

import numpy as np

from eposit.compiled.layout import LINEAR_RESULT
from eposit.pose import Pose
from eposit.problem import Problem, inverse_covariances
from eposit.results import solve_batch
from eposit.solution import Solution
from eposit.workspace import readable


def to_minimum(problem: Problem, start: Pose) -> Solution:
    """From b poses, R (b, 3, 3) and t (b, 3); NaN where there is none: NOT_CONVERGED. No covariance is stated."""
    from eposit.compiled.machine_code import native
    from eposit.compiled.refine import refine_poses

    n, call = len(problem.points_in_obj), native(refine_poses)
    obj, weights = np.ascontiguousarray(problem.points_in_obj), inverse_covariances(problem.weights)
    pixels = np.ascontiguousarray(problem.points_px)
    starts = np.ascontiguousarray(np.hstack((start.R.reshape(-1, 9), start.t)))  # hstack keeps the order of a transpose

    given = [readable(values) for values in (obj, pixels, weights)]
    begin = readable(starts)

    def run(w: int, out: int, first: int, stop: int) -> None:
        call(w, n, *given, n, len(pixels), first, stop, begin, out)

    return solve_batch(run, problem.camera, (len(pixels), n), LINEAR_RESULT, 1.0)
