"""Wrong points left out: each image is solved from the points that agree on one pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from eposit.arrays import Array, Mask
from eposit.camera import Camera
from eposit.problem import workspace
from eposit.solution import Solution, Status, in_order, join, without_pose

LEAST_POINTS = 8  # two may be exchanged: of the six others three give a pose, and three confirm it
CONTRADICTION = 5.0  # standard deviations of a chi-square's cube root from which a fit contradicts its sigma: 3e-7

SolvePart = Callable[[Mask, Array], Solution]  # (n,) points in use, (b, m, 2) their image points


def solve_robust(
    solve_part: SolvePart, obj: Array, pixels: Array, camera: Camera, weights: Array, variance: float
) -> Solution:
    """Solve every image of (b, n, 2) from its own inliers: images with the same ones as one batch.

    weights, variance: as `problem.as_weights` gives them. Where sigma is known and the residuals of an image's inliers
    contradict it, more points are wrong than can be left out: Status.INCONSISTENT.

    Raises:
        ValueError: fewer than eight points.
    """
    from eposit.compiled.machine_code import native
    from eposit.compiled.robust import find_inliers

    n = len(obj)
    if n < LEAST_POINTS:
        raise ValueError(
            f"robust=True was given {n} points; it takes {LEAST_POINTS} or more, so that with two exchanged three of "
            "the others give a pose and three confirm it: give more points or leave robust out"
        )
    w, there = workspace(camera, n), np.empty(pixels.shape[:2])
    native(find_inliers)(
        w.ctypes.data, n, obj.ctypes.data, pixels.ctypes.data, weights.ctypes.data, len(weights), len(pixels),
        variance, there.ctypes.data,
    )  # fmt: skip
    inliers = there == 1.0
    kinds, which = np.unique(inliers, axis=0, return_inverse=True)
    rows = [np.flatnonzero(which.reshape(-1) == i) for i in range(len(kinds))]
    parts = [
        solve_part(kind, np.ascontiguousarray(pixels[row][:, kind])) for row, kind in zip(rows, kinds, strict=True)
    ]
    if not parts:
        return solve_part(np.ones(n, np.bool_), pixels)
    parts = [replace(part, inliers=inliers[row]) for part, row in zip(parts, rows, strict=True)]
    solution = in_order(join(parts), np.concatenate(rows))
    return without_pose(solution, _contradicts(solution), Status.INCONSISTENT) if variance > 0.0 else solution


def _contradicts(solution: Solution) -> Mask:
    """(b,) mask of costs above the chi-square's quantile.

    Source:
        Wilson and Hilferty 1931: the cube root of a chi-square over its freedom is nearly normal.
    """
    freedom = 2.0 * np.sum(solution.inliers, axis=-1) - 6.0
    share = 2.0 / (9.0 * freedom)
    return np.asarray(solution.cost) > freedom * (1.0 - share + CONTRADICTION * np.sqrt(share)) ** 3
