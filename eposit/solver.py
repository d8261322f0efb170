"""`solve`: one entry for POSIT, EPOSIT, centred EPOSIT and the default method."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask, take_last
from eposit.camera import Camera
from eposit.linear_methods import posit_checked
from eposit.pose import PoseBatch
from eposit.problem import Problem, mark, validate
from eposit.rays import centred_image, onto_image_circle, rectify_paper, rectify_rays, unit_rays
from eposit.refine.minimise import RefinedPoses
from eposit.refine.reprojection import Observations, cost, residuals
from eposit.refine.weights import whitening
from eposit.robust import solve_robust
from eposit.search import best_poses
from eposit.shape import Shape
from eposit.solution import OK, Solution, SolutionBuffer, Status
from eposit.starts import turn_back

METHODS = ("best", "centred", "eposit", "posit")
CHUNK = 16384  # problems worked on at a time, fewer if they have many points: NumPy's calls spread over them
CHUNK_POINTS = 4 * CHUNK


def solve(
    points_in_obj: ArrayLike,
    points_px: ArrayLike,
    camera: Camera,
    method: str = "best",
    *,
    refine: bool = True,
    sigma_px: ArrayLike | None = None,
    robust: bool = False,
    tol: float = 1e-12,
    max_iterations: int = 2000,
    theta_centre: tuple[float, float] | None = None,
) -> Solution:
    """Pose of an object from n >= 4 points and their image, for one image or a batch.

    points_in_obj: (n, 3), any length unit. points_px: (n, 2) or (b, n, 2), px, pixel centres at integers.
    method: "best" (centred EPOSIT or a planar start, then Gauss-Newton), "centred", "eposit" (the paper's
        equations), "posit" (POSIT on pinhole-equivalent points).
    refine: Gauss-Newton after the start of "best"; the other methods are linear and never refined.
    sigma_px: standard deviation of the image points: a scalar, (n,), or (n, 2, 2) covariances, px and px^2. It
        weights the refinement and makes the covariance absolute; None scales the covariance by the residuals.
    robust: leave out wrong points, of n >= 8 up to one in four, with the same result in every run. With sigma_px a
        point is wrong by that measure, else by the scatter of the others; one image in a hundred without a wrong
        point loses one. The reprojection error and the covariance are those of the points in use, `inliers`.
    tol: relative change of I and J, in the last step or as it foretells the next, at which "centred", "eposit" and
        "posit" stop. max_iterations: their limit.
    theta_centre: for "eposit" only, the point, px, from which theta is measured; the paper takes the image centre.

    Returns:
        Solution; a batch gives the same poses as single calls to 1e-12. The covariance is that of "best"; the other
        methods do not weigh their points, so that it would not be theirs: NaN.
    Raises:
        ValueError: wrong shapes, fewer than four points (eight with `robust`), non-finite object points, an unknown
            method or sigma.
    Source:
        Kang et al., EPOSIT. Centring is ours: with exact theta EPOSIT is POSIT on rectified points, and rays may be
        rectified about M0's ray as well as about the optical axis, which lifts the limit of 54.7 degrees.
    """
    if method not in METHODS:
        raise ValueError(f"unknown method {method!r}; known methods are {', '.join(METHODS)}")
    if theta_centre is not None and method != "eposit":
        raise ValueError(f"theta_centre goes with method 'eposit', not {method!r}; leave it out")
    problem, single = validate(points_in_obj, points_px, camera, sigma_px)
    if robust:

        def solve_part(use: Mask, obj: Array, pixels: Array) -> Solution:
            sigma = sigma_px if sigma_px is None or np.ndim(sigma_px) == 0 else np.asarray(sigma_px)[use]
            return solve(
                obj, pixels, camera, method,
                refine=refine, sigma_px=sigma, tol=tol, max_iterations=max_iterations, theta_centre=theta_centre,
            )  # fmt: skip

        return solve_robust(solve_part, problem.points_in_obj, points_px, camera, problem.weights, problem.absolute)
    shape = Shape.of(problem.points_in_obj)
    out = SolutionBuffer.of(problem.status, method == "best")
    size = max(1, min(CHUNK, CHUNK_POINTS // len(problem.points_in_obj)))
    for i in range(0, len(problem.status), size):
        rows = slice(i, i + size)
        part, part_out = problem.part(rows), out.part(rows)
        with np.errstate(all="ignore"):
            if method == "best":
                _solve_best(part, shape, refine, part_out)
            else:
                _solve_linear(part, shape, method, tol, max_iterations, theta_centre, part_out)
    solution = out.solution().first() if single else out.solution()
    return replace(solution, inliers=np.ones(np.shape(points_px)[:-1], bool))


def _solve_linear(
    problem: Problem,
    shape: Shape,
    method: str,
    tol: float,
    max_iterations: int,
    theta_centre: tuple[float, float] | None,
    out: SolutionBuffer,
) -> None:
    back, n = None, len(shape.points_in_obj)
    view = Observations.of(problem.camera, problem.points_in_obj, problem.points_px, whitening(None, n))
    plain = method != "centred" and problem.camera.lens == "perspective"
    if plain:
        image = view.seen.transpose(1, 0, 2)  # pinhole points already, and all in front of the camera
    else:
        rays = unit_rays(problem.camera, view.seen)
        _mark_rays(problem.status, rays, method != "centred" and shape.solid)
        if method == "centred":
            image, back = centred_image(rays)
        elif method == "eposit":
            image = rectify_paper(problem.camera, view.seen, theta_centre)
        else:
            image = rectify_rays(rays)
    if not shape.solid:
        mark(problem.status, np.ones(len(problem.status), bool), Status.COPLANAR)
        out.fill_with_nan()
        return
    start, reproduces, squares = posit_checked(shape, image, tol, max_iterations)
    mark(problem.status, ~start.converged, Status.NOT_CONVERGED)
    mark(problem.status, ~reproduces, Status.INCONSISTENT)
    found = start if back is None else turn_back(back, start)
    if plain:
        costs = problem.camera.fx**2 * squares[0] + problem.camera.fy**2 * squares[1]
    else:
        costs = cost(residuals(view, found.R, found.t))
    _write(out, problem.status, found, costs, n)


def _solve_best(problem: Problem, shape: Shape, refined: bool, out: SolutionBuffer) -> None:
    view = Observations.of(problem.camera, problem.points_in_obj, problem.points_px, problem.weights)
    rays = unit_rays(problem.camera, onto_image_circle(problem.camera, view.seen))
    _mark_rays(problem.status, rays, False)
    if not shape.usable:
        mark(problem.status, np.ones(len(problem.status), bool), Status.COPLANAR)
        out.fill_with_nan()
        return
    found = best_poses(shape, view, rays, refined)
    mark(problem.status, ~(found.poses.converged & np.isfinite(found.cost)), Status.NOT_CONVERGED)
    finish(problem, found, out)


def finish(problem: Problem, found: RefinedPoses, out: SolutionBuffer) -> None:
    """Write poses, RMSE and covariance where the status is OK."""
    n, costs, spread = len(problem.points_in_obj), found.cost, found.spread
    if problem.absolute:
        plain = Observations.of(problem.camera, problem.points_in_obj, problem.points_px, whitening(None, n))
        costs = cost(residuals(plain, found.poses.R, found.poses.t))
    else:
        spread = spread * (costs / (2 * n - 6))
    rows = _write(out, problem.status, found.poses, costs, n)
    if rows is None:
        out.covariance[:] = spread.transpose(2, 0, 1)
    elif len(rows):
        out.covariance[rows] = take_last(spread, rows).transpose(2, 0, 1)


def _write(
    out: SolutionBuffer, status: NDArray[np.int8], found: PoseBatch, costs: Array, n: int
) -> NDArray[np.int64] | None:
    """Write poses and RMSE where the status is OK; those rows, None for all."""
    ok = status == OK
    if np.all(ok):
        out.R[:], out.t[:] = found.R.transpose(2, 0, 1), found.t.T
        np.sqrt(costs / n, out=out.rmse_px)
        out.iterations[:] = found.iterations
        return None
    rows = np.flatnonzero(ok)
    out.fill_with_nan()
    out.R[rows] = take_last(found.R, rows).transpose(2, 0, 1)
    out.t[rows] = take_last(found.t, rows).T
    out.rmse_px[rows] = np.sqrt(costs[rows] / n)
    out.iterations[:] = found.iterations
    return rows


def _mark_rays(status: NDArray[np.int8], rays: Array, forward: bool) -> None:
    """Outside the lens where there is no ray; beyond the field of POSIT where it does not point forward."""
    z = np.minimum.reduce(rays[:, 2], axis=0)
    mark(status, np.isnan(z), Status.OUTSIDE_LENS)
    if forward:
        mark(status, z <= 0.0, Status.BEYOND_90_DEGREES)
