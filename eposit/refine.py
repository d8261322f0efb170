"""Maximum-likelihood refinement: damped Gauss-Newton on the reprojection error, and the covariance at its minimum.

The pose changes by a rotation vector applied on the left in the camera frame (rad), then a translation: the same
six numbers, in the same order, as the covariance. Arrays are coordinates-first, (n, b): n points, b problems.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask, cross
from eposit.camera import Camera

STEP_TOL = 1e-11  # rad and relative translation; the floor of double precision is about 1e-13
COST_FLOOR = 1e-12  # relative growth of the cost that counts as rounding, not as a worse step
MAX_STEPS = 50


@dataclass(frozen=True, slots=True)
class Refined:
    """Poses at a local minimum of the weighted reprojection error."""

    R: Array  # (b, 3, 3)
    t: Array  # (b, 3)
    cost: Array  # (b,) sum of squared residuals: px^2, or without unit where they were divided by sigma
    steps: NDArray[np.int64]  # (b,)
    converged: Mask  # (b,)


def whitening(sigma_px: Array | None, n: int) -> Array:
    """(2, 2, n) matrices W with W^T W = inverse covariance; the identity for None.

    sigma_px: None, a scalar, (n,) standard deviations, or (n, 2, 2) covariances, px and px^2.

    Raises:
        ValueError: another shape, or a value that is not positive.
    """
    if sigma_px is None:
        return np.repeat(np.eye(2)[:, :, None], n, axis=2)
    sigma = np.asarray(sigma_px, dtype=np.float64)
    if sigma.shape in ((), (n,)):
        if not (np.all(np.isfinite(sigma)) and np.all(sigma > 0.0)):
            raise ValueError("sigma_px has values that are not positive; give standard deviations above 0 px")
        return np.eye(2)[:, :, None] / np.broadcast_to(sigma, n)
    if sigma.shape != (n, 2, 2):
        raise ValueError(f"sigma_px has shape {sigma.shape}; it must be a scalar, ({n},) or ({n}, 2, 2)")
    try:
        lower = np.linalg.cholesky(sigma)
    except np.linalg.LinAlgError:
        raise ValueError("sigma_px has a covariance that is not positive definite; check the (2, 2) blocks") from None
    return np.linalg.inv(lower).transpose(1, 2, 0)


def residuals(camera: Camera, points_in_obj: Array, u: Array, v: Array, R: Array, t: Array, weights: Array) -> Array:
    """(2, n, b) weighted residuals, projection minus observation; infinite where a point cannot be projected."""
    x, y, z = _in_camera(points_in_obj, R, t)
    return _weigh(weights, np.stack(_project(camera, x, y, z)) - np.stack((u, v)))


def refine_poses(
    camera: Camera, points_in_obj: Array, u: Array, v: Array, R: Array, t: Array, weights: Array
) -> Refined:
    """Levenberg-Marquardt from the given poses.

    points_in_obj: (n, 3). u, v: (n, b) px. R, t: (b, 3, 3), (b, 3); NaN rows stay NaN. weights: (2, 2, n).
    """
    state = Refined(R.copy(), t.copy(), np.full(len(t), np.inf), np.zeros(len(t), np.int64), np.zeros(len(t), bool))
    state.cost[:] = _cost(residuals(camera, points_in_obj, u, v, R, t, weights))
    damping = np.full(len(t), 1e-6)
    active = np.flatnonzero(np.isfinite(state.cost))
    for _ in range(MAX_STEPS):
        if not len(active):
            break
        ua, va, Ra, ta = u[:, active], v[:, active], state.R[active], state.t[active]
        normal, gradient = normal_equations(camera, points_in_obj, ua, va, Ra, ta, weights)
        step = _damped_step(normal, gradient, damping[active])
        R_new, t_new = _turn(step[:, :3], Ra), ta + step[:, 3:]
        cost_new = _cost(residuals(camera, points_in_obj, ua, va, R_new, t_new, weights))
        size = np.maximum(
            np.linalg.norm(step[:, :3], axis=1), np.linalg.norm(step[:, 3:], axis=1) / np.linalg.norm(ta, axis=1)
        )
        small = size <= STEP_TOL
        better = cost_new <= state.cost[active] * (1.0 + COST_FLOOR)
        accepted = active[better]
        state.R[accepted], state.t[accepted], state.cost[accepted] = R_new[better], t_new[better], cost_new[better]
        damping[active] = np.where(better, damping[active] * 0.1, np.maximum(damping[active], 1e-7) * 10.0)
        state.steps[active] += 1
        state.converged[active[small]] = True
        active = active[~small]
    return state


def normal_equations(
    camera: Camera, points_in_obj: Array, u: Array, v: Array, R: Array, t: Array, weights: Array
) -> tuple[Array, Array]:
    """(b, 6, 6) information matrix J^T J and (b, 6) gradient J^T r of the weighted residuals."""
    x, y, z = _in_camera(points_in_obj, R, t)
    pixel, slope = _project_with_slope(camera, x, y, z)
    residual = _weigh(weights, pixel - np.stack((u, v)))
    slope = np.stack([_weigh(weights, slope[:, axis]) for axis in range(3)], axis=1)
    arm = np.stack((x, y, z)) - t.T[:, None, :]  # lever arm of the rotation
    jacobian = np.empty((6, *residual.shape))
    for row in range(2):
        jacobian[:3, row] = cross(arm, slope[row])
        jacobian[3:, row] = slope[row]
    b = residual.shape[-1]
    normal, gradient = np.empty((b, 6, 6)), np.empty((b, 6))
    for i in range(6):
        gradient[:, i] = _sum(jacobian[i] * residual)
        for j in range(i, 6):
            normal[:, i, j] = normal[:, j, i] = _sum(jacobian[i] * jacobian[j])
    return normal, gradient


def covariance(normal: Array) -> Array:
    """(b, 6, 6) inverse of the information matrix, scaled first; NaN where it has no inverse."""
    scale = np.sqrt(np.einsum("bii->bi", normal))
    with np.errstate(all="ignore"):
        scaled = normal / (scale[:, :, None] * scale[:, None, :])
        usable = np.all(np.isfinite(scaled), axis=(1, 2))
        usable[usable] = np.linalg.cond(scaled[usable]) < 1e15
        inverse = np.full_like(normal, np.nan)
        inverse[usable] = np.linalg.inv(scaled[usable])
        return inverse / (scale[:, :, None] * scale[:, None, :])


def _damped_step(normal: Array, gradient: Array, damping: Array) -> Array:
    """(b, 6) steps of the normal equations scaled to a unit diagonal; zero where they cannot be solved."""
    scale = np.sqrt(np.maximum(np.einsum("bii->bi", normal), 1e-300))
    system = normal / (scale[:, :, None] * scale[:, None, :])
    system[:, range(6), range(6)] += damping[:, None] + 1e-15
    right = -(gradient / scale)[..., None]
    usable = np.all(np.isfinite(system), axis=(1, 2)) & np.all(np.isfinite(right), axis=(1, 2))
    step = np.zeros_like(gradient)
    step[usable] = np.linalg.solve(system[usable], right[usable])[..., 0] / scale[usable]
    return step


def _sum(values: Array) -> Array:
    """Sum of (2, n, b) over all but b, in one order for any b: NumPy adds a single column pairwise."""
    flat = values.reshape(values.shape[0] * values.shape[1], values.shape[2])
    return np.cumsum(flat, axis=0)[-1] if flat.shape[1] == 1 else np.add.reduce(flat, axis=0)


def _turn(vector: Array, R: Array) -> Array:
    """exp(vector) R for (b, 3) and (b, 3, 3), by Rodrigues' formula."""
    x, y, z = vector.T
    angle2 = x * x + y * y + z * z
    angle = np.sqrt(angle2)
    sine = np.sinc(angle / np.pi)  # sin(angle) / angle
    half = np.sinc(0.5 * angle / np.pi)
    bend = 0.5 * half * half  # (1 - cos(angle)) / angle^2
    zero = np.zeros_like(x)
    skew = np.stack((zero, -z, y, z, zero, -x, -y, x, zero), axis=-1).reshape(-1, 3, 3)
    turn = np.eye(3) + sine[:, None, None] * skew + bend[:, None, None] * (skew @ skew)
    return turn @ R


def _in_camera(points_in_obj: Array, R: Array, t: Array) -> tuple[Array, Array, Array]:
    """Camera coordinates, three (n, b) arrays, by fixed-order sums."""
    px, py, pz = points_in_obj.T[:, :, None]
    x, y, z = (R[:, i, 0] * px + R[:, i, 1] * py + R[:, i, 2] * pz + t[:, i] for i in range(3))
    return x, y, z


def _weigh(weights: Array, pair: Array) -> Array:
    """W @ (u, v) for a (2, n, b) pair."""
    w = weights[..., None]
    with np.errstate(invalid="ignore"):  # a point that cannot be projected is infinite
        return np.stack((w[0, 0] * pair[0] + w[0, 1] * pair[1], w[1, 0] * pair[0] + w[1, 1] * pair[1]))


def _cost(residual: Array) -> Array:
    with np.errstate(invalid="ignore", over="ignore"):
        total = _sum(residual**2)
    return np.where(np.isfinite(total), total, np.inf)


def _project(camera: Camera, x: Array, y: Array, z: Array) -> tuple[Array, Array]:
    """Smooth continuation of `Camera.project` past theta_max, so that a step may cross it; infinite past a pole."""
    scale, _, _ = _radial(camera, x, y, z)
    return camera.fx * x * scale + camera.cx, camera.fy * y * scale + camera.cy


def _project_with_slope(camera: Camera, x: Array, y: Array, z: Array) -> tuple[Array, Array]:
    """(2, n, b) pixels and (2, 3, n, b) derivatives by the camera coordinates."""
    scale, slope, side2 = _radial(camera, x, y, z)
    range2 = side2 + z**2
    bend = np.where(side2 > 0.0, (slope * z / range2 - scale) / np.where(side2 > 0.0, side2, 1.0), 0.0)
    forward = -slope / range2
    cross = x * y * bend
    du = np.stack((scale + x * x * bend, cross, forward * x)) * camera.fx
    dv = np.stack((cross, scale + y * y * bend, forward * y)) * camera.fy
    pixel = np.stack((camera.fx * x * scale + camera.cx, camera.fy * y * scale + camera.cy))
    return pixel, np.stack((du, dv))


def _radial(camera: Camera, x: Array, y: Array, z: Array) -> tuple[Array, Array, Array]:
    """rho / side, d rho / d theta and side^2, where side is the distance from the optical axis."""
    law = camera.law
    side2 = x**2 + y**2
    side = np.sqrt(side2)
    theta = np.arctan2(side, z)
    if np.isinf(law.rho_max):  # a pole at theta_max: nothing lies beyond it
        theta = np.where(theta < law.theta_max, theta, np.nan)
    with np.errstate(divide="ignore", invalid="ignore"):
        on_axis = side == 0.0
        scale = np.where(on_axis, 1.0 / z, law.raw_rho(theta) / np.where(on_axis, 1.0, side))
    return np.where(np.isnan(scale), np.inf, scale), law.raw_slope(theta), side2
