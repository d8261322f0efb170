"""POSIT, EPOSIT and centred EPOSIT: linear starts that iterate on scaled orthography.

The three share one iteration and differ in how image points become pinhole-equivalent points (x, y at depth 1):
POSIT takes them from the bearing, EPOSIT from the paper's G(theta), centred EPOSIT from bearings turned so that
M0's ray is the axis. Arrays here are coordinates-first, (n, b): n points, b problems.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask, cross
from eposit.camera import Camera
from eposit.p3p import p3p_starts

CONVERGENT_TAN = np.sqrt(2.0)  # tan of the incidence angle beyond which the iteration no longer contracts
DOUBTFUL_MISFIT = 1e-3  # misfit over spread above which a fixed point is compared with the poses of a triangle
CONSISTENT_MISFIT = 0.1  # misfit over spread above which a fixed point is no pose
EXACT_MISFIT = 1e-7  # misfit over spread of a triangle's pose that shows noise-free points, which EPOSIT then must fit
COPLANAR_CONDITION = 1e4  # cond(A) from which the points count as coplanar: there double precision leaves 12 digits


@dataclass(frozen=True, slots=True)
class Start:
    """Poses from a linear method; rows that failed are NaN."""

    R: Array  # (b, 3, 3)
    t: Array  # (b, 3), unit of the object points
    iterations: NDArray[np.int64]  # (b,)
    converged: Mask  # (b,)

    def put(self, rows: NDArray[np.int64], other: Start) -> None:
        """Overwrite some rows with those of another result; iterations add up."""
        self.R[rows], self.t[rows], self.converged[rows] = other.R, other.t, other.converged
        self.iterations[rows] += other.iterations


def condition(points_in_obj: Array) -> float:
    """cond(A) of the (n, 3) points' offsets from M0; infinite for coplanar or repeated points."""
    values = np.linalg.svd(points_in_obj[1:] - points_in_obj[0], compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0.0 else float("inf")


def rectify_bearings(bearings: Array) -> tuple[Array, Array]:
    """(b, n, 3) unit vectors to pinhole points x, y, each (n, b); NaN at or beyond 90 degrees."""
    x, y, z = np.moveaxis(bearings, -1, 0)
    depth = np.where(z > 0.0, z, np.nan)
    return (x / depth).T, (y / depth).T


def rectify_paper(
    points_px: Array, camera: Camera, theta_centre: tuple[float, float] | None = None
) -> tuple[Array, Array]:
    """(b, n, 2) px to x' / (f G) and y' / (f G), each (n, b).

    theta_centre: the point, px, that theta is measured from; the principal point if None. The paper measures
    theta from the image centre and subtracts the principal point from x and y.
    Source:
        Paper, Table I and equations 21 and 22: G(theta) = cos(theta) / g(theta).
    """
    centre_x, centre_y = (camera.cx, camera.cy) if theta_centre is None else theta_centre
    u, v = points_px[..., 0].T, points_px[..., 1].T
    radius = np.hypot((u - centre_x) / camera.fx, (v - centre_y) / camera.fy)
    theta = camera.law.theta(radius)
    theta = np.where(theta < np.pi / 2, theta, np.nan)
    inverse_ratio = camera.law.g(theta) / np.cos(theta)
    return (u - camera.cx) / camera.fx * inverse_ratio, (v - camera.cy) / camera.fy * inverse_ratio


def centring_rotations(bearings: Array) -> Array:
    """(b, 3, 3) shortest rotations that carry M0's ray, row 0 of (b, n, 3), onto the z axis."""
    x, y, z = np.moveaxis(bearings[:, 0], -1, 0)
    backward = z < -0.5  # the shortest rotation is ill-conditioned near -z: first turn half a revolution about x
    flip = np.where(backward, -1.0, 1.0)
    y, z = flip * y, flip * z
    w = 1.0 / (1.0 + z)
    rows = np.stack((1.0 - x * x * w, -x * y * w, -x, -x * y * w, 1.0 - y * y * w, -y, x, y, z), axis=-1)
    rotation = rows.reshape(-1, 3, 3)
    return rotation * np.stack((np.ones_like(flip), flip, flip), axis=-1)[:, None, :]


def posit(
    points_in_obj: Array,
    x: Array,
    y: Array,
    tol: float,
    max_iterations: int,
    epsilon: Array | None = None,
    step: float = 1.0,
) -> Start:
    """The POSIT iteration on pinhole points.

    points_in_obj: (n, 3), not coplanar. x, y: (n, b), image points at depth 1.
    tol: stop when I and J change by less than this, relative to their length.
    epsilon: (n - 1, b) first guess of the relative depths, zero if None. step: fraction of each update that is taken.
    Source:
        Paper, equations 21 to 25; DeMenthon and Davis 1995.
    """
    offsets = points_in_obj[1:] - points_in_obj[0]
    solver: Array = np.linalg.pinv(offsets)
    b = x.shape[1]
    stacked = np.full((6, b), np.nan)  # I above J
    iterations = np.zeros(b, dtype=np.int64)
    converged = np.zeros(b, dtype=bool)
    active = np.flatnonzero(np.all(np.isfinite(x) & np.isfinite(y), axis=0))
    xa, ya = x[:, active], y[:, active]
    epsilon = np.zeros((len(offsets), len(active))) if epsilon is None else epsilon[:, active]
    previous = np.full((6, len(active)), np.inf)
    with np.errstate(all="ignore"):
        for _ in range(max_iterations):
            if not len(active):
                break
            vectors = _solve_scaled(solver, xa, ya, epsilon)
            scale, k = _scale_and_axis(vectors)
            epsilon = epsilon + step * (scale * rows(offsets, k) - epsilon)
            change = np.max(np.abs(vectors - previous), axis=0) / scale
            iterations[active] += 1
            stacked[:, active] = vectors
            done = change <= tol
            converged[active[done]] = True
            keep = ~done & np.isfinite(scale)
            previous = vectors
            if not np.all(keep):
                active, xa, ya = active[keep], xa[:, keep], ya[:, keep]
                epsilon, previous = epsilon[:, keep], previous[:, keep]
        R, t = _pose(stacked, x[0], y[0], points_in_obj[0])
    lost = ~converged
    R[lost], t[lost] = np.nan, np.nan
    return Start(R, t, iterations, converged)


def posit_checked(points_in_obj: Array, x: Array, y: Array, tol: float, max_iterations: int) -> tuple[Start, Mask]:
    """`posit`, retried inside its limit, and a (b,) mask of the poses that reproduce their points.

    The fixed point that the iteration finds need not be the pose (about one random object in a thousand), and a pose
    need not attract it. A misfit of a tenth of the points' spread tells, and for noise-free points the poses of a
    triangle do: one of them fits exactly. From it the same equations are iterated again with half steps, provided
    that all points lie below atan(sqrt 2). Under noise a flat object's misfit is large and no reason to reject.
    """
    start = posit(points_in_obj, x, y, tol, max_iterations)
    misfit, spread = _misfit(points_in_obj, x, y, start.R, start.t)
    limit = CONSISTENT_MISFIT * spread
    doubtful = np.flatnonzero(~(misfit <= DOUBTFUL_MISFIT * spread) & np.all(np.isfinite(x) & np.isfinite(y), axis=0))
    if not len(doubtful):
        return start, misfit <= limit
    xd, yd = x[:, doubtful], y[:, doubtful]
    rays = np.stack((xd.T, yd.T, np.ones_like(xd.T)), axis=-1)
    ((R, t),) = p3p_starts(points_in_obj, rays / np.linalg.norm(rays, axis=-1, keepdims=True), 1)
    exact = _misfit(points_in_obj, xd, yd, R, t)[0] <= EXACT_MISFIT * spread[doubtful]
    limit[doubtful[exact]] = DOUBTFUL_MISFIT * spread[doubtful[exact]]
    inside = np.all(np.hypot(xd, yd) < CONVERGENT_TAN, axis=0) & (t[:, 2] > 0.0)
    again = ~(misfit[doubtful] <= limit[doubtful]) & inside
    if np.any(again):
        offsets = points_in_obj[1:] - points_in_obj[0]
        epsilon = (R[again, 2] @ offsets.T).T / (t[again] + R[again] @ points_in_obj[0])[:, 2]
        retried = posit(points_in_obj, xd[:, again], yd[:, again], tol, max_iterations, epsilon, 0.5)
        start.put(doubtful[again], retried)
        misfit, _ = _misfit(points_in_obj, x, y, start.R, start.t)
    return start, misfit <= limit


def _misfit(points_in_obj: Array, x: Array, y: Array, R: Array, t: Array) -> tuple[Array, Array]:
    """RMS distance of reprojections from the pinhole points, and the RMS spread of those, each (b,)."""
    with np.errstate(all="ignore"):
        px, py, pz = np.moveaxis(points_in_obj @ np.swapaxes(R, 1, 2) + t[:, None], -1, 0)
        misses = (px / pz).T - x, (py / pz).T - y
        misfit = np.sqrt(np.mean(misses[0] ** 2 + misses[1] ** 2, axis=0))
        spread = np.sqrt(np.mean((x - x.mean(axis=0)) ** 2 + (y - y.mean(axis=0)) ** 2, axis=0))
        return np.where(np.all(pz > 0.0, axis=1), misfit, np.nan), spread


def _solve_scaled(solver: Array, x: Array, y: Array, epsilon: Array) -> Array:
    """I and J, (6, b), from the right-hand sides xi and eta (paper, equations 21 to 25)."""
    factor = 1.0 + epsilon
    return np.concatenate((rows(solver, factor * x[1:] - x[0]), rows(solver, factor * y[1:] - y[0])))


def rows(matrix: Array, columns: Array) -> Array:
    """matrix @ columns with a fixed order of additions, so that a batch gives the bits of single calls."""
    total = matrix[:, :1] * columns[0]
    for j in range(1, matrix.shape[1]):
        total = total + matrix[:, j : j + 1] * columns[j]
    return total


def _scale_and_axis(vectors: Array) -> tuple[Array, Array]:
    """Scale 1 / Z0, the mean length of I and J, and the unit third axis k."""
    i, j = vectors[:3], vectors[3:]
    scale = 0.5 * (norm(i) + norm(j))
    k = cross(i, j)
    return scale, k / norm(k)


def nearest_frame(vectors: Array) -> Array:
    """(b, 3, 3) rotations with rows i, j, k from I above J, (6, b), the defect shared between i and j."""
    i, j = vectors[:3] / norm(vectors[:3]), vectors[3:] / norm(vectors[3:])
    total, difference = i + j, i - j
    total, difference = total / norm(total), difference / norm(difference)
    i, j = (total + difference) * np.sqrt(0.5), (total - difference) * np.sqrt(0.5)
    return np.ascontiguousarray(np.stack((i, j, cross(i, j))).transpose(2, 0, 1))


def _pose(vectors: Array, x0: Array, y0: Array, first: Array) -> tuple[Array, Array]:
    """Rotation and position of the object frame from I above J and M0's pinhole and object coordinates."""
    rotation = nearest_frame(vectors)
    depth = 2.0 / (norm(vectors[:3]) + norm(vectors[3:]))
    return rotation, np.stack((x0 * depth, y0 * depth, depth), axis=-1) - rotation @ first


def norm(vector: Array) -> Array:
    """Length of (3, ...) vectors along the first axis."""
    return np.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
