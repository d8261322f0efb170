"""Wrong points left out: each image is solved from the points that agree on one pose."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from eposit.arrays import Array, Mask
from eposit.camera import Camera
from eposit.chi_square import chi_square_limit
from eposit.solution import Solution, Status, in_order, join, without_pose
from eposit.workspace import give_back, lend, readable

LEAST_POINTS = 8  # two may be exchanged: of the six others three give a pose, and three confirm it

# -2 log of the likelihood of a wrong point that lies at a right one's place, beside a right one's: it may lie anywhere
# in some 400 x 400 standard deviations. Poses whose likelihoods differ by less are rivals.
WRONG = 20.0
TINY = 1e-12  # px^2: a sum of squares below it is rounding

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
    from eposit.compiled.robust import FEW, KEPT, find_inliers

    n = len(obj)
    if n < LEAST_POINTS:
        raise ValueError(
            f"robust=True was given {n} points; it takes {LEAST_POINTS} or more, so that with two exchanged three of "
            "the others give a pose and three confirm it: give more points or leave robust out"
        )
    kept = KEPT if n <= FEW else 1
    workspace, there, sums = lend(camera, n), np.zeros((len(pixels), kept, n)), np.empty((len(pixels), kept, 2))
    try:
        native(find_inliers)(
            workspace.address, n, readable(obj), readable(pixels), readable(weights), len(weights), len(pixels),
            variance, kept, there.ctypes.data, sums.ctypes.data,
        )  # fmt: skip
    finally:
        give_back(workspace)
    inliers, rivalled = _likeliest(there == 1.0, sums, variance)
    kinds, which = np.unique(inliers, axis=0, return_inverse=True)
    rows = [np.flatnonzero(which.reshape(-1) == i) for i in range(len(kinds))]
    parts = [
        solve_part(kind, np.ascontiguousarray(pixels[row][:, kind])) for row, kind in zip(rows, kinds, strict=True)
    ]
    if not parts:
        return solve_part(np.ones(n, np.bool_), pixels)
    parts = [replace(part, inliers=inliers[row]) for part, row in zip(parts, rows, strict=True)]
    solution = in_order(join(parts), np.concatenate(rows))
    solution = replace(solution, ambiguous=solution.ambiguous | (rivalled & (np.asarray(solution.status) == Status.OK)))
    return without_pose(solution, _contradicts(solution), Status.INCONSISTENT) if variance > 0.0 else solution


def _likeliest(chosen: Mask, sums: Array, variance: float) -> tuple[Mask, Mask]:
    """(b, n) inliers of the likeliest of k poses, and (b,) whether another one with other points is nearly as likely.

    Of ten points, half of them wrong, five of which some are wrong often agree on a pose as well as the right five.
    chosen: (b, k, n) inliers of each pose. sums: (b, k, 2) as `find_inliers` gives them; infinite where there is none.
    Where sigma is unknown, the pose of the least trimmed squares is taken, and the scatter about each pose, if its
    points are not fewer, is compared in their place.
    """
    count, rows = chosen.sum(axis=2), np.arange(len(chosen))
    missing = ~np.isfinite(sums[..., 1])
    if variance > 0.0:
        price = sums[..., 1] / variance + WRONG * (chosen.shape[2] - count)
        best = np.argmin(price, axis=1)
    else:
        freedom = np.maximum(2.0 * count - 6.0, 1.0)
        best = np.argmin(sums[..., 0], axis=1)
        scatter = np.log(np.maximum(sums[..., 1], TINY) / freedom)
        fewer = count < count[rows, best][:, None]
        price = np.where(fewer, np.inf, freedom * (scatter - scatter[rows, best][:, None]))
    price = np.where(missing, np.inf, price)
    inliers = chosen[rows, best]
    other = np.any(chosen & ~inliers[:, None], axis=2)
    return inliers, np.any(other & (price < price[rows, best][:, None] + WRONG), axis=1)


def _contradicts(solution: Solution) -> Mask:
    """(b,) mask of costs that contradict the stated sigma."""
    return np.asarray(solution.cost) > chi_square_limit(2.0 * np.sum(solution.inliers, axis=-1) - 6.0)
