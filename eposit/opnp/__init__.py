"""OPnP: the global optimum of an algebraic reprojection cost over all rotations, from all its critical points."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask
from eposit.camera import Camera
from eposit.descent import to_minimum
from eposit.opnp.candidates import Candidates, join_candidates, table
from eposit.opnp.critical_points import FIRST, SECOND, ZERO, critical_points, newton_step
from eposit.pose import Pose, PoseBatch
from eposit.problem import Problem, mark, validate
from eposit.refine.weights import covariance, normal_equations
from eposit.shape import COPLANAR_CONDITION, plane_axes
from eposit.solution import OK, Solution, Status, join, status_names

CHUNK = 32  # problems worked on at a time; each takes half a megabyte
REAL = 1e-4  # relative imaginary part below which a root is tried as real; what is not does not converge
STEP_TOL = 1e-9  # relative Newton step after which the error, its square, is rounding
MAX_STEPS = 20
SAME = 1e-6  # relative distance below which two polished roots are one; rounding leaves 1e-8


@dataclass(frozen=True, slots=True, kw_only=True)
class OpnpSolution(Solution):
    """A `Solution` with all real solutions of the polynomial system."""

    candidates: Candidates  # points behind the camera included; cost as `solve` defines it
    pairs: int | NDArray[np.int64]  # distinct complex solutions +-x found: 40, fewer where some coincide or form curves

    def first(self) -> OpnpSolution:
        """The single problem of a batch of one, without its leading axis."""
        return _extended(Solution.first(self), self.candidates.first(), int(np.asarray(self.pairs)[0]))


@dataclass(frozen=True, slots=True)
class _System:
    """cost = unit^2 |A v(y) + d|^2 of m images; the scaled quaternion is x = sqrt(stretch / size) U y, U fixed."""

    offsets: Array  # (n, 3) object points from their centroid, over their size
    centroid: Array  # (3,)
    size: float  # RMS distance from the centroid
    u: Array  # (m, n)
    v: Array  # (m, n)
    A: Array  # (m, r, 10)
    d: Array  # (m, r)
    stretch: Array  # (m,)
    unit: Array  # (m,)


@np.errstate(all="ignore")  # of sizes whose squares no number holds there is no solution
def solve(
    points_in_obj: ArrayLike,
    points_px: ArrayLike,
    camera: Camera,
    *,
    sigma_px: ArrayLike | None = None,
    refine: bool = False,
) -> OpnpSolution:
    """Pose by OPnP from n >= 4 points, in a plane or not, for one image or a batch.

    points_in_obj: (n, 3), any length unit. points_px: (n, 2) or (b, n, 2), px.
    sigma_px: as for `eposit.solve`; it enters the covariance (and refine=True), not OPnP's own cost.
    refine: descend on the reprojection error from the selected pose. Near the axis there is nothing to
        gain: up to 35 degrees errors are within 1 % of the refined ones, which reach the Cramer-Rao bound. A fish-eye
        image's noise, seen at depth 1, grows with the field angle: 1.2 times the bound at 60 degrees, 1.7 at 75.

    With (u, v) a bearing's point at depth 1, X a point's offset from the centroid and the rotation's rows r1, r2, r3
    and the translation divided by the centroid's depth, the cost is the sum over points of
    |(1 + r3.X) (u, v) - (r1.X + t1, r2.X + t2)|^2: the squared distance at depth 1, weighted by the squared ratio of
    the point's depth to the centroid's. It has 40 pairs of critical points.

    Selection: all roots that are real (a relative imaginary part below 1e-4) are polished by Newton on this cost; of
    those that converge and have all points at positive depth the one of lowest cost is the pose. Points in a plane
    are no special case: the mirrored pose is another root, and the lower cost decides. Where costs are equal to the
    last bit (three distinct points with exact data have up to four poses of cost zero) the choice is arbitrary:
    `candidates` has them all.

    Returns:
        OpnpSolution. iterations are the Newton steps of the selected root, and those of the descent. Candidates are
        ordered by cost and padded with NaN to the longest list of a batch; poses with points behind the camera are in
        it. The covariance is the inverse of the information matrix.
        Status BEYOND_90_DEGREES: a point at or beyond 90 degrees; OUTSIDE_LENS; COPLANAR: the points lie on a line;
        NO_SOLUTION: no real root has all points in front. A batch gives the same poses as single calls to 1e-12.
    Raises:
        ValueError: wrong shapes, fewer than four points, non-finite object points, or an unusable sigma.
    Source:
        Zheng, Kuang, Sugimoto, Astrom, Okutomi, Revisiting the PnP problem: a fast, general and optimal solution,
        ICCV 2013: the cost and its parameters. Its critical points are found otherwise: see `critical_points`.
    """
    problem, single = validate(points_in_obj, points_px, camera, sigma_px)
    parts = [_solve(part, refine) for part in problem.chunks(CHUNK)]
    if single:
        return parts[0].first()
    candidates = join_candidates([part.candidates for part in parts])
    return _extended(join(list(parts)), candidates, np.concatenate([np.asarray(part.pairs) for part in parts]))


def _solve(problem: Problem, refine: bool) -> OpnpSolution:
    status, u, v = _checked(problem)
    b, good = len(status), np.flatnonzero(status == OK)
    system = _system(problem.points_in_obj, u[:, good].T, v[:, good].T)
    roots, pairs = critical_points(system.A, system.d)
    all_pairs = np.zeros(b, np.int64)
    all_pairs[good] = pairs
    row, y, steps, cost = _real(roots, system)
    R, t, depth = _poses(system, row, y)
    candidates = Candidates(Pose(table(good[row], R, b), table(good[row], t, b)), table(good[row], cost, b))
    front = np.flatnonzero(np.all(depth > 0.0, axis=1))
    rows, first = np.unique(row[front], return_index=True)
    lowest = front[first]
    found = PoseBatch(np.full((3, 3, b), np.nan), np.full((3, b), np.nan), np.zeros(b, np.int64), np.zeros(b, bool))
    selected = good[rows]
    found.R[..., selected], found.t[:, selected] = R[lowest].transpose(1, 2, 0), t[lowest].T
    found.iterations[selected], found.converged[selected] = steps[lowest], True
    mark(status, ~found.converged, Status.NO_SOLUTION)
    if refine:
        refined = to_minimum(problem, Pose(found.R.transpose(2, 0, 1), found.t.T))
        found.R[:], found.t[:] = refined.cam_from_obj.R.transpose(1, 2, 0), refined.cam_from_obj.t.T
        found.iterations[:] += np.asarray(refined.iterations)
        mark(status, np.asarray(refined.status) != Status.OK, Status.NOT_CONVERGED)
    return _extended(_finished(problem, found, status), candidates, all_pairs)


def _finished(problem: Problem, found: PoseBatch, status: NDArray[np.int8]) -> Solution:
    """Poses, RMSE and covariances at the poses, as `eposit.solve` states them; NaN where the status is not OK."""
    ok, n = status == OK, len(problem.points_in_obj)
    R = np.ascontiguousarray(np.where(ok, found.R, np.nan).transpose(2, 0, 1))
    t = np.ascontiguousarray(np.where(ok, found.t, np.nan).T)
    residuals = problem.camera.project(Pose(R, t).apply(problem.points_in_obj)) - problem.points_px
    rmse = np.sqrt(np.sum(residuals**2, axis=(1, 2)) / n)
    spread = np.full((len(ok), 6, 6), np.nan)
    if np.any(ok):
        u, v = problem.uv
        normal, _ = normal_equations(
            problem.camera, problem.points_in_obj, u[:, ok], v[:, ok], R[ok], t[ok], problem.weights
        )
        factor = 1.0 if problem.absolute else rmse[ok, None, None] ** 2 * n / (2 * n - 6)
        spread[ok] = covariance(normal) * factor
    return Solution(status_names(status), Pose(R, t), np.where(ok, found.iterations, 0), rmse, spread)


def _checked(problem: Problem) -> tuple[NDArray[np.int8], Array, Array]:
    """Status so far, and the bearings' points at depth 1, each (n, b)."""
    status = problem.status.copy()
    bearings = problem.camera.bearing(problem.points_px)
    mark(status, np.any(np.isnan(bearings), axis=(1, 2)), Status.OUTSIDE_LENS)
    mark(status, np.any(bearings[..., 2] <= 0.0, axis=1), Status.BEYOND_90_DEGREES)
    _, _, spreads = plane_axes(problem.points_in_obj)
    mark(status, np.full(len(status), bool(spreads[1] <= spreads[0] / COPLANAR_CONDITION)), Status.COPLANAR)
    with np.errstate(invalid="ignore", divide="ignore"):
        u, v = (np.where(bearings[..., 2] > 0.0, bearings[..., k] / bearings[..., 2], np.nan).T for k in range(2))
    mark(status, (np.ptp(u, axis=0) == 0.0) & (np.ptp(v, axis=0) == 0.0), Status.NO_SOLUTION)
    return status, u, v


@functools.cache
def _forms() -> Array:
    """(9, 10) rotation, row by row, times |y|^2, as quadratic forms of y, where the quaternion is w, x, y, z = U y.

    U is a rotation drawn once: problems with symmetric numbers then are nothing special to the elimination.
    """
    square, product = np.eye(4)[:, :, None] * np.eye(4)[:, None, :], np.zeros((4, 4, 4, 4))
    for i in range(4):
        for j in range(4):
            product[i, j, i, j] += 1.0
            product[i, j, j, i] += 1.0
    ww, xx, yy, zz = square
    wx, wy, wz = product[0, 1:]
    xy, xz, yz = product[1, 2], product[1, 3], product[2, 3]
    rows = (
        ww + xx - yy - zz,
        xy - wz,
        xz + wy,
        xy + wz,
        ww - xx + yy - zz,
        yz - wx,
        xz - wy,
        yz + wx,
        ww - xx - yy + zz,
    )
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(4, 4)))[0]
    turned = turn.T @ np.stack(rows) @ turn
    return turned[:, FIRST, SECOND] * np.where(FIRST == SECOND, 1.0, 2.0)


def _system(points_in_obj: Array, u: Array, v: Array) -> _System:
    """The cost of (m, n) pinhole points with t1 and t2 eliminated by subtracting means."""
    centroid = points_in_obj.mean(axis=0)
    size = float(np.sqrt(np.mean(np.sum((points_in_obj - centroid) ** 2, axis=1)))) or 1.0  # all one point: no images
    offsets = (points_in_obj - centroid) / size
    m, n = u.shape
    by_rotation = np.zeros((m, 2, n, 9))
    for axis, image in enumerate((u, v)):
        seen = image[..., None] * offsets
        by_rotation[:, axis, :, 6:] = seen - seen.mean(axis=1, keepdims=True)
        by_rotation[:, axis, :, 3 * axis : 3 * axis + 3] = -offsets
    A = by_rotation.reshape(m, 2 * n, 9) @ _forms()
    d = np.concatenate((u - u.mean(axis=1, keepdims=True), v - v.mean(axis=1, keepdims=True)), axis=1)
    unit = np.linalg.norm(d, axis=1)
    norm = np.linalg.norm(A, axis=(1, 2))
    stretch = 3.0 * unit / norm  # the forms' mean over the sphere is below their norm: then |y| is about 1
    rows = np.concatenate((A * (3.0 / norm)[:, None, None], d[..., None] / unit[:, None, None]), axis=2)
    reduced = np.asarray(np.linalg.qr(rows, mode="r"))
    return _System(offsets, centroid, size, u, v, reduced[..., :10], reduced[..., 10], stretch, unit)


def _real(roots: Array, system: _System) -> tuple[NDArray[np.int64], Array, NDArray[np.int64], Array]:
    """Real roots polished by Newton, ordered by problem and cost: problem (k,), y (k, 4), steps (k,) and cost (k,).

    Those that do not converge are left out, and of those that converge to one point all but the first. A loop of its
    own: the unknown is a quaternion, the Hessian exact, and saddle points are roots, too, which a descent would leave:
    of 202 real roots of 100 noisy problems of eight points 101 are saddle points.
    """
    with np.errstate(invalid="ignore"):
        near = np.linalg.norm(roots.imag, axis=2) <= REAL * np.linalg.norm(roots.real, axis=2)
    row, place = np.nonzero(near)
    y = roots.real[row, place]
    steps, active = np.zeros(len(row), np.int64), np.arange(len(row))
    with np.errstate(all="ignore"):
        for _ in range(MAX_STEPS):
            if not len(active):
                break
            step = newton_step(y[active, None], system.A[row[active]], system.d[row[active]])[:, 0]
            y[active] += step
            steps[active] += 1
            active = active[~(np.linalg.norm(step, axis=1) <= STEP_TOL * np.linalg.norm(y[active], axis=1))]
    kept = np.setdiff1d(np.flatnonzero(np.linalg.norm(y, axis=1) > ZERO), active)
    cost = _cost(system, row[kept], y[kept])
    by_cost = np.lexsort((cost, row[kept]))
    order = kept[by_cost]
    single = ~_twin(row[order], y[order])
    order = order[single]
    return row[order], y[order], steps[order], cost[by_cost][single]


def _twin(row: NDArray[np.int64], y: Array) -> Mask:
    """(k,) roots that an earlier root of their problem equals, up to its sign."""
    inner = y @ y.T
    length2 = np.diag(inner)
    distance2 = length2[:, None] + length2 - 2.0 * np.abs(inner)
    same = (row[:, None] == row) & (distance2 <= SAME**2 * length2)
    return np.any(np.tril(same, -1), axis=1)


def _poses(system: _System, row: NDArray[np.int64], y: Array) -> tuple[Array, Array, Array]:
    """R (k, 3, 3), t (k, 3), and depths (k, n) over the centroid's, of the roots y of the problems `row`."""
    length2 = np.sum(y**2, axis=1)
    R = (_products(y) @ _forms().T / length2[:, None]).reshape(-1, 3, 3)
    inverse = system.stretch[row] * length2  # size over depth
    turned = system.offsets @ np.swapaxes(R, 1, 2) * inverse[:, None, None]
    depth = 1.0 + turned[..., 2]
    sight = np.stack((np.mean(system.u[row] * depth, axis=1), np.mean(system.v[row] * depth, axis=1)), axis=1)
    centre = np.column_stack((sight, np.ones(len(y)))) * (system.size / inverse)[:, None]
    return R, centre - R @ system.centroid, depth


def _cost(system: _System, row: NDArray[np.int64], y: Array) -> Array:
    residual = (system.A[row] @ _products(y)[..., None])[..., 0] + system.d[row]
    return np.sum(residual**2, axis=1) * system.unit[row] ** 2


def _products(y: Array) -> Array:
    return y[..., FIRST] * y[..., SECOND]


def _extended(solution: Solution, candidates: Candidates, pairs: int | NDArray[np.int64]) -> OpnpSolution:
    fields = (solution.status, solution.cam_from_obj, solution.iterations, solution.reprojection_rmse_px)
    return OpnpSolution(*fields, solution.covariance, candidates=candidates, pairs=pairs)
