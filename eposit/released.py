"""The solver that the EPOSIT paper's figures come from: its released code, as it behaves, defects included.

Written from a description of its behaviour, to reproduce the paper's figures; for poses use `eposit.solve`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask, cross, take_last
from eposit.camera import Camera
from eposit.posit.orthography import lengths, nearest_frame
from eposit.problem import Problem, mark, validate
from eposit.solution import OK, Solution, SolutionBuffer, Status, join

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
    x, y = (u - camera.cx) / f, (v - camera.cy) / f
    first = ratio = _ratio(camera, x, y)
    mark(status, np.any(np.hypot(x, y) > 1.0, axis=0), Status.OUTSIDE_LENS)
    if theta_centre is not None:
        x_theta, y_theta = (u - theta_centre[0]) / f, (v - theta_centre[1]) / f
        ratio = _ratio(camera, x_theta, y_theta)
        mark(status, np.any(np.hypot(x_theta, y_theta) > 1.0, axis=0), Status.OUTSIDE_LENS)
    image = np.stack((x, y))
    vectors, iterations = _iterate(problem.points_in_obj, image, first, ratio, tol, max_iterations)
    with np.errstate(all="ignore"):
        size = lengths(vectors)
        scale = 0.5 * (size[0] + size[1])
        t = np.stack((*image[:, 0] * ratio[0], ratio[0] ** 2)) / scale
        R = nearest_frame(vectors, size)
        t -= np.einsum("ijb,j->ib", R, problem.points_in_obj[0])
    mark(status, ~np.all(np.isfinite(t), axis=0), Status.NOT_CONVERGED)
    found = SolutionBuffer.of(status, False)
    found.fill_with_nan()
    ok = np.flatnonzero(status == OK)
    found.R[ok], found.t[ok] = R[..., ok].transpose(2, 0, 1), t[:, ok].T
    found.iterations[:] = iterations
    return found.solution()


def _ratio(camera: Camera, x: Array, y: Array) -> Array:
    """G(theta) = cos(theta) / g(theta) with theta = asin(r / f), NaN where that has no value."""
    with np.errstate(all="ignore"):
        theta = np.arcsin(np.hypot(x, y))
        if camera.lens == "equidistance":
            return np.cos(theta) / (np.sin(theta) / theta)
        return np.cos(theta) / camera.law.raw_g(theta)


def _iterate(
    points_in_obj: Array, image: Array, first: Array, ratio: Array, tol: float, max_iterations: int
) -> tuple[Array, NDArray[np.int64]]:
    """I and J, (2, 3, b), and the number of iterations, (b,). image: (2, n, b). first, ratio: (n, b)."""
    offsets = points_in_obj[1:] - points_in_obj[0]
    solver: Array = np.linalg.pinv(offsets)
    b = image.shape[-1]
    result, iterations = np.full((2, 3, b), np.nan), np.zeros(b, np.int64)
    active = np.flatnonzero(np.all(np.isfinite(first + ratio), axis=0))
    epsilon, previous = np.zeros((len(offsets), len(active))), np.full((2, 3, len(active)), np.inf)
    flat, g0 = image[..., active] / first[:, active], first[0, active]
    with np.errstate(all="ignore"):
        for count in range(1, max_iterations + 1):
            if not len(active):
                break
            vectors = np.einsum("ij,ajb->aib", solver, (1.0 + epsilon) * flat[:, 1:] - flat[:, :1])
            size = lengths(vectors)
            scale = 0.5 * np.add.reduce(size, axis=0)
            k = cross(*(vectors / size[:, None])) / g0**2
            epsilon = np.einsum("ni,ib->nb", offsets, k) * scale / g0**2
            keep: Mask = (np.max(np.abs(vectors - previous), axis=(0, 1)) > tol * scale) & np.isfinite(scale)
            if not np.all(keep) or count == max_iterations:
                result[..., active], iterations[active] = vectors, count
                rows = np.flatnonzero(keep)
                active, epsilon, vectors = active[rows], take_last(epsilon, rows), take_last(vectors, rows)
                flat, g0 = take_last(flat, rows), g0[rows]
            if count == 1:
                flat, g0 = image[..., active] / ratio[:, active], ratio[0, active]
            previous = vectors
    return result, iterations
