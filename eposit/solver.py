"""`solve`: one entry for POSIT, EPOSIT, centred EPOSIT and the default method."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask
from eposit.camera import Camera
from eposit.pose import Pose
from eposit.posit import COPLANAR_CONDITION, Start, condition, posit_checked, rectify_bearings, rectify_paper
from eposit.problem import Problem, mark, validate
from eposit.refine import Refined, covariance, normal_equations, refine_poses, residuals, whitening
from eposit.solution import Solution, Status, join
from eposit.starts import centred_points, rim_bearings, starts, turn_back

METHODS = ("best", "centred", "eposit", "posit")
CHUNK = 4096  # problems worked on at a time


def solve(
    points_in_obj: ArrayLike,
    points_px: ArrayLike,
    camera: Camera,
    method: str = "best",
    *,
    refine: bool = True,
    sigma_px: ArrayLike | None = None,
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
    tol: relative change of I and J at which "centred", "eposit" and "posit" stop. max_iterations: their limit.
    theta_centre: for "eposit" only, the point, px, from which theta is measured; the paper takes the image centre.

    Returns:
        Solution; a batch gives the same poses as single calls to 1e-12.
    Raises:
        ValueError: wrong shapes, fewer than four points, non-finite object points, an unknown method or sigma.
    Source:
        Kang et al., EPOSIT. Centring is ours: with exact theta EPOSIT is POSIT on rectified points, and rays may be
        rectified about M0's ray as well as about the optical axis, which lifts the limit of 54.7 degrees.
    """
    if method not in METHODS:
        raise ValueError(f"unknown method {method!r}; known methods are {', '.join(METHODS)}")
    if theta_centre is not None and method != "eposit":
        raise ValueError(f"theta_centre goes with method 'eposit', not {method!r}; leave it out")
    problem, single = validate(points_in_obj, points_px, camera, sigma_px)
    parts: list[Solution] = []
    for part in problem.chunks(CHUNK):
        if method == "best":
            parts.append(_solve_best(part, refine))
        else:
            parts.append(_solve_linear(part, method, tol, max_iterations, theta_centre))
    return parts[0].first() if single else join(parts)


def _solve_linear(
    problem: Problem, method: str, tol: float, max_iterations: int, theta_centre: tuple[float, float] | None
) -> Solution:
    status = problem.status.copy()
    bearings = problem.camera.bearing(problem.points_px)
    mark(status, _any_row(np.isnan(bearings)), Status.OUTSIDE_LENS)
    if condition(problem.points_in_obj) > COPLANAR_CONDITION:
        return _coplanar(problem, status)
    back = np.broadcast_to(np.eye(3), (len(status), 3, 3))
    if method == "centred":
        x, y, back = centred_points(bearings)
    else:
        mark(status, np.any(bearings[..., 2] <= 0.0, axis=1), Status.FIELD_ANGLE)
        if method == "eposit":
            x, y = rectify_paper(problem.points_px, problem.camera, theta_centre)
        else:
            x, y = rectify_bearings(bearings)
    start, reproduces = posit_checked(problem.points_in_obj, x, y, tol, max_iterations)
    mark(status, ~start.converged, Status.NOT_CONVERGED)
    mark(status, ~reproduces, Status.INCONSISTENT)
    return finish(problem, turn_back(back, start), status)


def _solve_best(problem: Problem, refined: bool) -> Solution:
    status = problem.status.copy()
    bearings = rim_bearings(problem.camera, problem.points_px)
    mark(status, _any_row(np.isnan(bearings)), Status.OUTSIDE_LENS)
    found = starts(problem.points_in_obj, bearings)
    if not found:
        return _coplanar(problem, status)
    candidates = _candidates(problem, found, refined)
    best = _lowest(candidates, len(found))
    mark(status, ~(best.converged & np.isfinite(best.cost)), Status.NOT_CONVERGED)
    return finish(problem, Start(best.R, best.t, best.steps, best.converged), status)


def _candidates(problem: Problem, found: list[Start], refined: bool) -> Refined:
    """All starts of all problems as one batch, start by start, refined or as they are."""
    u, v = (np.tile(pixels, (1, len(found))) for pixels in problem.uv)
    R, t = np.concatenate([start.R for start in found]), np.concatenate([start.t for start in found])
    begun = np.concatenate([start.iterations for start in found])
    converged = np.concatenate([start.converged for start in found])
    if refined:
        result = refine_poses(problem.camera, problem.points_in_obj, u, v, R, t, problem.weights)
        return Refined(result.R, result.t, result.cost, result.steps + begun, result.converged)
    weighted = residuals(problem.camera, problem.points_in_obj, u, v, R, t, problem.weights)
    cost = np.nan_to_num(np.sum(weighted**2, axis=(0, 1)), nan=np.inf)
    return Refined(R, t, cost, begun, converged)


def _lowest(candidates: Refined, starts_each: int) -> Refined:
    """For each problem the converged candidate of lowest cost; the earlier one where costs are equal."""
    cost = np.where(candidates.converged, candidates.cost, np.inf).reshape(starts_each, -1)
    rows = np.argmin(cost, axis=0) * cost.shape[1] + np.arange(cost.shape[1])
    R, t, converged = candidates.R[rows], candidates.t[rows], candidates.converged[rows]
    return Refined(R, t, candidates.cost[rows], candidates.steps[rows], converged)


def _rmse(problem: Problem, R: Array, t: Array) -> Array:
    u, v = problem.uv
    plain = whitening(None, len(problem.points_in_obj))
    with np.errstate(invalid="ignore", over="ignore"):
        misses = residuals(problem.camera, problem.points_in_obj, u, v, R, t, plain)
        return np.sqrt(np.mean(np.sum(misses**2, axis=0), axis=0))


def _any_row(values: Mask) -> Mask:
    return np.asarray(np.any(values, axis=tuple(range(1, values.ndim))))


def _coplanar(problem: Problem, status: NDArray[np.str_]) -> Solution:
    mark(status, np.ones(len(status), bool), Status.COPLANAR)
    b = len(status)
    nothing = Start(np.full((b, 3, 3), np.nan), np.full((b, 3), np.nan), np.zeros(b, np.int64), np.zeros(b, bool))
    return finish(problem, nothing, status)


def finish(problem: Problem, found: Start, status: NDArray[np.str_]) -> Solution:
    """The result of b problems: NaN where the status is not OK, RMSE and covariance of the rest."""
    ok = status == Status.OK
    R, t = np.where(ok[:, None, None], found.R, np.nan), np.where(ok[:, None], found.t, np.nan)
    rmse = np.where(ok, _rmse(problem, R, t), np.nan)
    spread = np.full((len(ok), 6, 6), np.nan)
    if np.any(ok):
        u, v = problem.uv
        normal, _ = normal_equations(
            problem.camera, problem.points_in_obj, u[:, ok], v[:, ok], R[ok], t[ok], problem.weights
        )
        n = len(problem.points_in_obj)
        factor = 1.0 if problem.absolute else rmse[ok] ** 2 * n / (2 * n - 6)
        spread[ok] = covariance(normal) * np.reshape(factor, (-1, 1, 1))
    return Solution(status, Pose(R, t), found.iterations, rmse, spread)
