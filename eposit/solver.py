"""`solve`: one entry for POSIT, EPOSIT, centred EPOSIT and the default method."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask
from eposit.camera import Camera
from eposit.pose import Pose
from eposit.posit import COPLANAR_CONDITION, Start, condition, posit_checked, rectify_bearings, rectify_paper
from eposit.refine import Refined, covariance, normal_equations, refine_poses, residuals, whitening
from eposit.robust import solve_robust
from eposit.solution import STATUS_TYPE, Solution, Status, join
from eposit.starts import centred_points, rim_bearings, starts, turn_back

METHODS = ("best", "centred", "eposit", "posit")
CHUNK = 4096  # problems worked on at a time


@dataclass(frozen=True, slots=True)
class _Problem:
    """Validated input: b images of the same n object points."""

    points_in_obj: Array  # (n, 3)
    points_px: Array  # (b, n, 2), zeros where a row is not usable
    camera: Camera
    status: NDArray[np.str_]  # (b,), OK where the row is usable so far
    weights: Array  # (2, 2, n)
    absolute: bool  # whether the covariance is absolute: sigma_px was given

    @property
    def uv(self) -> tuple[Array, Array]:
        return self.points_px[..., 0].T, self.points_px[..., 1].T


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
    tol: relative change of I and J at which "centred", "eposit" and "posit" stop. max_iterations: their limit.
    theta_centre: for "eposit" only, the point, px, from which theta is measured; the paper takes the image centre.

    Returns:
        Solution; a batch gives the same poses as single calls to 1e-12.
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
    problem, single = _validate(points_in_obj, points_px, camera, sigma_px)
    if robust:

        def solve_part(use: Mask, obj: Array, pixels: Array) -> Solution:
            sigma = sigma_px if sigma_px is None or np.ndim(sigma_px) == 0 else np.asarray(sigma_px)[use]
            options: dict[str, Any] = {"tol": tol, "max_iterations": max_iterations, "theta_centre": theta_centre}
            return solve(obj, pixels, camera, method, refine=refine, sigma_px=sigma, **options)

        return solve_robust(solve_part, problem.points_in_obj, points_px, camera, problem.weights, problem.absolute)
    parts: list[Solution] = []
    for part in _chunks(problem):
        if method == "best":
            parts.append(_solve_best(part, refine))
        else:
            parts.append(_solve_linear(part, method, tol, max_iterations, theta_centre))
    solution = parts[0].first() if single else join(parts)
    return replace(solution, inliers=np.ones(np.shape(points_px)[:-1], bool))


def _chunks(problem: _Problem) -> Iterator[_Problem]:
    """The batch in pieces whose arrays stay in the cache; an empty batch is one piece."""
    for i in range(0, max(1, len(problem.status)), CHUNK):
        rows = slice(i, i + CHUNK)
        yield replace(problem, points_px=problem.points_px[rows], status=problem.status[rows])


def _validate(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, sigma_px: ArrayLike | None
) -> tuple[_Problem, bool]:
    obj = np.asarray(points_in_obj, dtype=np.float64)
    pixels = np.asarray(points_px, dtype=np.float64)
    if obj.ndim != 2 or obj.shape[1] != 3:
        raise ValueError(f"points_in_obj has shape {obj.shape}; it must be (n, 3)")
    if len(obj) < 4:
        raise ValueError(f"points_in_obj has {len(obj)} points; a pose needs at least 4")
    if not np.all(np.isfinite(obj)):
        raise ValueError("points_in_obj has NaN or infinite coordinates; give finite ones")
    if pixels.ndim not in (2, 3) or pixels.shape[-2:] != (len(obj), 2):
        raise ValueError(f"points_px has shape {pixels.shape}; it must be ({len(obj)}, 2) or (b, {len(obj)}, 2)")
    single = pixels.ndim == 2
    pixels = pixels[None] if single else pixels
    finite = np.all(np.isfinite(pixels), axis=(1, 2))
    status = np.where(finite, Status.OK, Status.NON_FINITE).astype(STATUS_TYPE)
    pixels = np.where(finite[:, None, None], pixels, 0.0)
    weights = whitening(None if sigma_px is None else np.asarray(sigma_px, dtype=np.float64), len(obj))
    return _Problem(obj, pixels, camera, status, weights, sigma_px is not None), single


def _solve_linear(
    problem: _Problem, method: str, tol: float, max_iterations: int, theta_centre: tuple[float, float] | None
) -> Solution:
    status = problem.status.copy()
    bearings = problem.camera.bearing(problem.points_px)
    _mark(status, _any_row(np.isnan(bearings)), Status.OUTSIDE_LENS)
    if condition(problem.points_in_obj) > COPLANAR_CONDITION:
        return _coplanar(problem, status)
    back = np.broadcast_to(np.eye(3), (len(status), 3, 3))
    if method == "centred":
        x, y, back = centred_points(bearings)
    else:
        _mark(status, np.any(bearings[..., 2] <= 0.0, axis=1), Status.FIELD_ANGLE)
        if method == "eposit":
            x, y = rectify_paper(problem.points_px, problem.camera, theta_centre)
        else:
            x, y = rectify_bearings(bearings)
    start, reproduces = posit_checked(problem.points_in_obj, x, y, tol, max_iterations)
    _mark(status, ~start.converged, Status.NOT_CONVERGED)
    _mark(status, ~reproduces, Status.INCONSISTENT)
    return _finish(problem, turn_back(back, start), status)


def _solve_best(problem: _Problem, refined: bool) -> Solution:
    status = problem.status.copy()
    bearings = rim_bearings(problem.camera, problem.points_px)
    _mark(status, _any_row(np.isnan(bearings)), Status.OUTSIDE_LENS)
    found = starts(problem.points_in_obj, bearings)
    if not found:
        return _coplanar(problem, status)
    candidates = _candidates(problem, found, refined)
    best = _lowest(candidates, len(found))
    _mark(status, ~(best.converged & np.isfinite(best.cost)), Status.NOT_CONVERGED)
    return _finish(problem, Start(best.R, best.t, best.steps, best.converged), status)


def _candidates(problem: _Problem, found: list[Start], refined: bool) -> Refined:
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


def _rmse(problem: _Problem, R: Array, t: Array) -> Array:
    u, v = problem.uv
    plain = whitening(None, len(problem.points_in_obj))
    with np.errstate(invalid="ignore", over="ignore"):
        misses = residuals(problem.camera, problem.points_in_obj, u, v, R, t, plain)
        return np.sqrt(np.mean(np.sum(misses**2, axis=0), axis=0))


def _any_row(values: Mask) -> Mask:
    return np.asarray(np.any(values, axis=tuple(range(1, values.ndim))))


def _mark(status: NDArray[np.str_], failed: Mask, reason: Status) -> None:
    """Give rows that are still OK a reason to fail; the first reason stays."""
    status[failed & (status == Status.OK)] = reason


def _coplanar(problem: _Problem, status: NDArray[np.str_]) -> Solution:
    _mark(status, np.ones(len(status), bool), Status.COPLANAR)
    b = len(status)
    nothing = Start(np.full((b, 3, 3), np.nan), np.full((b, 3), np.nan), np.zeros(b, np.int64), np.zeros(b, bool))
    return _finish(problem, nothing, status)


def _finish(problem: _Problem, found: Start, status: NDArray[np.str_]) -> Solution:
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
