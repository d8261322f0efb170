"""Wrong points left out: least trimmed squares from the poses of triangles, then a forward search with a test.

No random numbers: the triangles are a fixed design of the object.

Source:
    Rousseeuw and Van Driessen 2006, Computing LTS Regression for Large Data Sets (concentration steps); Atkinson and
    Riani 2000, Robust Diagnostic Regression Analysis (forward search); Rosner 1983, Percentage Points for a
    Generalized ESD Many-Outlier Procedure (the largest number of outliers that a test confirms is taken).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask, take_last
from eposit.camera import Camera
from eposit.pose import Pose
from eposit.robust.ray_residuals import RayObservations, distances, fit, ray_observations, squares
from eposit.robust.triangle_design import spread_triangles
from eposit.solution import Solution, join
from eposit.starts.p3p import p3p_poses

LEAST_POINTS = 8  # two may be exchanged: of the six others three give a pose, and three confirm it
TRIANGLES = 24
KEPT = 4  # starts that are followed; a triangle has no more poses
STEPS = 3  # concentration steps of each
FALSE_ALARM = 0.01  # share of images without a wrong point that may lose one
SCALE_FLOOR_PX = 1e-6  # scatter below this is rounding
CHUNK_POINTS = 1 << 12  # images times points worked on at a time

SolvePart = Callable[[Mask, Array, Array], Solution]  # (n,) points in use, (m, 3) and (b, m, 2) of those


def find_inliers(points_in_obj: Array, points_px: Array, camera: Camera, weights: Array, known: bool) -> Mask:
    """(b, n) points that agree on one pose, three in four or more of them.

    points_in_obj: (n, 3). points_px: (b, n, 2). weights: (2, 2, n) that whiten the image points, in full if `known`,
    else up to a scale that the points themselves tell. A point that is NaN or that no ray reaches counts as wrong.

    Raises:
        ValueError: fewer than eight points.
    """
    n = len(points_in_obj)
    if n < LEAST_POINTS:
        raise ValueError(
            f"robust=True was given {n} points; it takes {LEAST_POINTS} or more, so that with two exchanged three of "
            "the others give a pose and three confirm it: give more points or leave robust out"
        )
    view = ray_observations(points_in_obj, points_px, camera, weights, known)
    inliers = np.ones(points_px.shape[:2], bool)
    triangles, size = spread_triangles(points_in_obj, TRIANGLES), max(1, CHUNK_POINTS // n)
    for i in range(0, len(points_px) if triangles else 0, size):
        rows = np.arange(i, min(i + size, len(points_px)))
        part = view.take(rows)
        enough = np.sum(np.isfinite(part.rays[:, 0]), axis=0) >= view.least
        with np.errstate(all="ignore"):
            found = _search(part, *_trimmed(part, triangles))
        inliers[rows] = np.where(enough, found, True).T
    return inliers


def solve_robust(
    solve_part: SolvePart, points_in_obj: Array, points_px: ArrayLike, camera: Camera, weights: Array, known: bool
) -> Solution:
    """Solve every image, (n, 2) or (b, n, 2), from its own inliers: images with the same ones as one batch.

    Raises:
        ValueError: fewer than eight points.
    """
    pixels = np.asarray(points_px, dtype=np.float64)
    batch = pixels.reshape(-1, len(points_in_obj), 2)
    inliers = find_inliers(points_in_obj, batch, camera, weights, known)
    kinds, which = np.unique(inliers, axis=0, return_inverse=True)
    rows = [np.flatnonzero(which.reshape(-1) == i) for i in range(len(kinds))]
    parts = [
        solve_part(kind, points_in_obj[kind], batch[row][:, kind]) for row, kind in zip(rows, kinds, strict=True)
    ] or [solve_part(np.ones(len(points_in_obj), bool), points_in_obj, batch)]
    solution = replace(_in_order(join(parts), np.concatenate([*rows, np.arange(0)])), inliers=inliers)
    return solution.first() if pixels.ndim == 2 else solution


def _in_order(solution: Solution, rows: NDArray[np.int64]) -> Solution:
    """A batch whose problem i belongs in row rows[i]."""
    order, pose = np.argsort(rows), solution.cam_from_obj
    status, iterations, rmse = (
        np.asarray(values)[order] for values in (solution.status, solution.iterations, solution.reprojection_rmse_px)
    )
    return Solution(status, Pose(pose.R[order], pose.t[order]), iterations, rmse, solution.covariance[order])


def _trimmed(view: RayObservations, triangles: list[list[int]]) -> tuple[tuple[Array, Array], Mask]:
    """Pose and points of the least trimmed squares: the lowest sum of the `least` smallest squared residuals."""
    b = view.rays.shape[-1]
    several = view.take(np.tile(np.arange(b), KEPT))  # KEPT poses of each image, b columns apart
    sums, R, t = (np.concatenate(parts, axis=-1) for parts in zip(*_of_triangles(several, triangles, b), strict=True))
    pose = _cheapest(sums, R, t, b, KEPT)
    for _ in range(STEPS):
        pose = fit(several, _nearest(squares(several, *pose), view.least), pose)
    best = _cheapest(_trimmed_sum(several, *pose), *pose, b, 1)
    return best, _nearest(squares(view, *best), view.least)


def _of_triangles(several: RayObservations, triangles: list[list[int]], b: int) -> Iterator[tuple[Array, Array, Array]]:
    """For each triangle the trimmed sums (KEPT b,), R and t of its KEPT best poses in each image."""
    for three in triangles:
        poses = p3p_poses(several.points_in_obj[three], several.rays[three][..., :b], KEPT)
        R, t = (np.concatenate(parts, axis=-1) for parts in zip(*poses, strict=True))
        yield _trimmed_sum(several, R, t), R, t


def _trimmed_sum(view: RayObservations, R: Array, t: Array) -> Array:
    """(b,) sums of the `least` smallest squared residuals."""
    return np.add.reduce(np.partition(squares(view, R, t), view.least - 1, axis=0)[: view.least], axis=0)


def _cheapest(sums: Array, R: Array, t: Array, b: int, count: int) -> tuple[Array, Array]:
    """Of k poses of each image, b columns apart, the `count` of lowest sums, lowest first, b columns apart."""
    order = np.argsort(sums.reshape(-1, b), axis=0, kind="stable")[:count]
    columns = (order * b + np.arange(b)).ravel()
    return take_last(R, columns), take_last(t, columns)


def _search(view: RayObservations, pose: tuple[Array, Array], chosen: Mask) -> Mask:
    """Add the nearest point, one at a time; the points before the first that a test refuses are the answer.

    The test: the squared residual of the nearest point outside, over its variance given the pose of those inside,
    has an F distribution with 2 and the pose's degrees of freedom, whose tail is (1 + 2 x / f)^(-f / 2).
    """
    n, b = chosen.shape
    answer, open_ = np.ones_like(chosen), np.ones(b, bool)
    for m in range(view.least, n):
        pose = fit(view, chosen, pose)
        distance = distances(view, chosen, *pose)
        freedom, tail = 2 * m - 6, FALSE_ALARM / (m + 1)
        limit = -np.log(tail) if view.known else 0.5 * freedom * (tail ** (-2.0 / freedom) - 1.0)
        spread = np.sum(np.where(chosen, squares(view, *pose), 0.0), axis=0) / freedom
        scale = 1.0 if view.known else np.maximum(spread, SCALE_FLOOR_PX**2)
        nearest = np.min(np.where(chosen, np.inf, distance), axis=0)
        refused = open_ & ~(nearest / (2.0 * scale) <= limit)
        answer[:, refused] = chosen[:, refused]
        open_ &= ~refused
        if not np.any(open_):
            break
        chosen = _nearest(distance, m + 1)
    return answer


def _nearest(values: Array, count: int) -> Mask:
    """(n, b) mask of the `count` smallest of each column, earlier points first where equal."""
    order = np.argsort(values, axis=0, kind="stable")[:count]
    mask = np.zeros(values.shape, bool)
    np.put_along_axis(mask, order, True, axis=0)
    return mask
