"""The solver that the EPOSIT paper's figures come from: its released code, as it behaves, defects included.

Written from a description of its behaviour, to reproduce the paper's figures; for poses use `eposit.solve`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask, cross
from eposit.camera import Camera
from eposit.pose import Pose
from eposit.posit import nearest_frame, norm, rows
from eposit.problem import Problem, mark, validate
from eposit.solution import Solution, Status, join

MAX_ITERATIONS = 50_000
CHUNK = 4096  # problems worked on at a time


def solve(
    points_in_obj: ArrayLike,
    points_px: ArrayLike,
    camera: Camera,
    *,
    theta_centre: tuple[float, float] | None = None,
    tol: float = 1e-12,
    max_iterations: int = MAX_ITERATIONS,
) -> Solution:
    """Pose by EPOSIT as released, for one image or a batch.

    points_in_obj: (n, 3), n >= 4, any length unit. points_px: (n, 2) or (b, n, 2), px. camera: f is the mean of fx
    and fy. theta_centre: the point, px, that theta is measured from; the principal point if None. tol: relative
    change of I and J at which the iteration stops. max_iterations: its limit.

    Known defects, all kept but for the stop test:
    - G(theta) of M0 enters the scale twice: with I and J as in the paper's equations 21 to 25 it takes
      Z = f G0^2 / |I| and X = x0' G0 / |I|, where f / |I| and x0' / (G0 |I|) would be right, and rows i and j of
      length 1 / G0, so that k has the length 1 / G0^2 in the relative depths. Depths come out short by 1 - G0^2.
      The rotation returned has unit rows.
    - theta = asin(r / f) for every lens, so a pinhole camera has no theta beyond 45 degrees: OUTSIDE_LENS.
    - The first iteration measures theta from the principal point whatever theta_centre says.
    - G is 0 / 0 on the axis of an equidistance lens: NOT_CONVERGED.
    - No convergence flag: after max_iterations the last pose counts as OK. No check for coplanar points. No residual
      and no covariance: both are NaN.
    - Its stop test ends the iteration after one step where the threshold is declared as a floating-point number; the
      paper's figures need the iteration to converge, so here it does.

    Raises:
        ValueError: wrong shapes, fewer than four points, or object points that are not finite.
    Source:
        Kang et al., EPOSIT, equations 13 and 21 to 25, and the behaviour of the code released with it.
    """
    problem, single = validate(points_in_obj, points_px, camera)
    parts = [_solve(part, theta_centre, tol, max_iterations) for part in problem.chunks(CHUNK)]
    return parts[0].first() if single else join(parts)


def _solve(problem: Problem, theta_centre: tuple[float, float] | None, tol: float, max_iterations: int) -> Solution:
    camera, status = problem.camera, problem.status.copy()
    f = 0.5 * (camera.fx + camera.fy)
    u, v = problem.uv
    first = _ratio(camera, f, u - camera.cx, v - camera.cy)
    ratio = first if theta_centre is None else _ratio(camera, f, u - theta_centre[0], v - theta_centre[1])
    radius = np.hypot(u - camera.cx, v - camera.cy)
    if theta_centre is not None:
        radius = np.maximum(radius, np.hypot(u - theta_centre[0], v - theta_centre[1]))
    mark(status, np.any(radius > f, axis=0), Status.OUTSIDE_LENS)
    x, y = (u - camera.cx) / f, (v - camera.cy) / f
    vectors, iterations = _iterate(problem.points_in_obj, x, y, first, ratio, tol, max_iterations)
    with np.errstate(all="ignore"):
        scale = 0.5 * (norm(vectors[:3]) + norm(vectors[3:]))
        t = np.stack((x[0] * ratio[0] / scale, y[0] * ratio[0] / scale, ratio[0] ** 2 / scale), axis=-1)
        R = nearest_frame(vectors)
    t = t - (R @ problem.points_in_obj[0])
    mark(status, ~np.all(np.isfinite(t), axis=1), Status.NOT_CONVERGED)
    ok = status == Status.OK
    pose = Pose(np.where(ok[:, None, None], R, np.nan), np.where(ok[:, None], t, np.nan))
    nothing = np.full(len(ok), np.nan)
    return Solution(status, pose, iterations, nothing, np.full((len(ok), 6, 6), np.nan))


def _ratio(camera: Camera, f: float, x: Array, y: Array) -> Array:
    """G(theta) = cos(theta) / g(theta) with theta = asin(r / f), NaN where that has no value."""
    with np.errstate(all="ignore"):
        theta = np.arcsin(np.hypot(x, y) / f)
        if camera.lens == "equidistance":
            return np.cos(theta) / (np.sin(theta) / theta)
        return np.cos(theta) / camera.law.raw_g(theta)


def _iterate(
    points_in_obj: Array, x: Array, y: Array, first: Array, ratio: Array, tol: float, max_iterations: int
) -> tuple[Array, NDArray[np.int64]]:
    """I above J, (6, b), and the number of iterations, (b,). x, y, first, ratio: (n, b)."""
    offsets = points_in_obj[1:] - points_in_obj[0]
    solver: Array = np.linalg.pinv(offsets)
    b = x.shape[1]
    result, iterations = np.full((6, b), np.nan), np.zeros(b, np.int64)
    active = np.flatnonzero(np.all(np.isfinite(first + ratio), axis=0))
    epsilon, previous = np.zeros((len(offsets), len(active))), np.full((6, len(active)), np.inf)
    with np.errstate(all="ignore"):
        for count in range(max_iterations):
            if not len(active):
                break
            g = (ratio if count else first)[:, active]
            wide, high = x[:, active] / g, y[:, active] / g
            factor = 1.0 + epsilon
            vectors = np.concatenate(
                (rows(solver, factor * wide[1:] - wide[0]), rows(solver, factor * high[1:] - high[0]))
            )
            scale = 0.5 * (norm(vectors[:3]) + norm(vectors[3:]))
            i, j = (part / (norm(part) * g[0]) for part in (vectors[:3], vectors[3:]))
            epsilon = rows(offsets, cross(i, j)) * scale / g[0] ** 2
            result[:, active], iterations[active] = vectors, count + 1
            keep: Mask = (np.max(np.abs(vectors - previous), axis=0) > tol * scale) & np.isfinite(scale)
            active, epsilon, previous = active[keep], epsilon[:, keep], vectors[:, keep]
    return result, iterations
