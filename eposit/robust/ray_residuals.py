"""Residuals in the plane across each ray, scaled to pixels, and Gauss-Newton on a choice of points for each image.

To first order a residual is the reprojection error, for every lens and beyond 90 degrees. Arrays are images first,
(b, n), and poses may have more axes before these, as (k, b, 3, 3).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from eposit.arrays import Array, Mask
from eposit.camera import Camera
from eposit.pose import rotation_from_vector
from eposit.rays import onto_image_circle, unit_rays

RIDGE = 1e-12  # on the unit diagonal of normal equations, so that points that give no pose give no exception


@dataclass(frozen=True, slots=True)
class RayObservations:
    """b images of n points as rays."""

    points_in_obj: Array  # (n, 3)
    rays: Array  # (b, n, 3) unit vectors, NaN where there is none
    slopes: Array  # (b, n, 2, 3) whitened pixels for a small change of the ray
    known: bool  # whether the standard deviation is known: 1 after whitening

    @property
    def least(self) -> int:
        """Points that must be right: three in four."""
        return -(-3 * self.rays.shape[1] // 4)

    def take(self, rows: slice) -> RayObservations:
        """Some of the images."""
        return replace(self, rays=self.rays[rows], slopes=self.slopes[rows])


def ray_observations(
    points_in_obj: Array, points_px: Array, camera: Camera, weights: Array, known: bool
) -> RayObservations:
    """Rays and slopes: d rho along the radius and rho / sin(theta) across it, times f, whitened."""
    seen = (points_px - (camera.cx, camera.cy)) / (camera.fx, camera.fy)
    with np.errstate(invalid="ignore"):
        rays = unit_rays(camera, onto_image_circle(camera, seen.transpose(1, 2, 0))).transpose(2, 0, 1)
    x, y, z = np.moveaxis(rays, -1, 0)
    side = np.hypot(x, y)
    on_axis = side == 0.0
    cos, sin = (np.where(on_axis, fill, part / np.where(on_axis, 1.0, side)) for part, fill in ((x, 1.0), (y, 0.0)))
    theta = np.arctan2(side, z)
    outwards = np.stack((cos * z, sin * z, -side), axis=-1) * camera.law.slope(theta)[..., None]
    with np.errstate(divide="ignore"):
        across = np.stack((-sin, cos, 0.0 * cos), axis=-1) / camera.law.g(theta)[..., None]
    du = camera.fx * (cos[..., None] * outwards - sin[..., None] * across)
    dv = camera.fy * (sin[..., None] * outwards + cos[..., None] * across)
    return RayObservations(points_in_obj, rays, np.moveaxis(weights, 2, 0) @ np.stack((du, dv), axis=-2), known)


def _residuals(view: RayObservations, R: Array, t: Array) -> tuple[Array, Array, Array]:
    """(b, n, 2) whitened residuals, NaN behind a ray; (b, n, 3) turned points; (b, n, 3) their camera coordinates."""
    arm = view.points_in_obj @ np.swapaxes(R, -1, -2)
    point = arm + t[..., None, :]
    unit = point / np.sqrt(np.sum(point**2, axis=-1, keepdims=True))
    seen = np.sum(unit * view.rays, axis=-1) > 0.0
    residual = (view.slopes @ (unit - view.rays)[..., None])[..., 0]
    return np.where(seen[..., None], residual, np.nan), arm, point


def squares(view: RayObservations, R: Array, t: Array) -> Array:
    """(b, n) squared residuals, infinite where there is none."""
    squares = np.sum(_residuals(view, R, t)[0] ** 2, axis=-1)
    return np.where(np.isfinite(squares), squares, np.inf)


def _linear(view: RayObservations, R: Array, t: Array) -> tuple[Array, Array]:
    """(b, n, 2) residuals and (b, n, 2, 6) slopes by a rotation vector on the left, then t."""
    residual, arm, point = _residuals(view, R, t)
    distance = np.sqrt(np.sum(point**2, axis=-1))[..., None, None]
    unit = point[..., None, :] / distance
    by_point = (view.slopes - (view.slopes @ np.swapaxes(unit, -1, -2)) * unit) / distance
    return residual, np.concatenate((np.cross(arm[..., None, :], by_point), by_point), axis=-1)


def fit(view: RayObservations, chosen: Mask, cam_from_obj: tuple[Array, Array]) -> tuple[Array, Array]:
    """Two Gauss-Newton steps on the chosen points, each taken where it does not raise their squares.

    A loop of its own beside `refine.minimise`: each image has its own choice of points, poses have one more axis, and
    residuals are those of rays, which exist for points that a projection on trial would put outside the lens.
    """
    R, t = cam_from_obj
    for _ in range(2):
        residual, slope = _linear(view, R, t)
        gradient = np.sum(_chosen(np.swapaxes(slope, -1, -2) @ residual[..., None], chosen), axis=-3)
        step = -(_covariance(slope, chosen) @ gradient)[..., 0]
        R_new, t_new = rotation_from_vector(step[..., :3]) @ R, t + step[..., 3:]
        before, after = (np.sum(np.where(chosen, squares(view, *p), 0.0), axis=-1) for p in ((R, t), (R_new, t_new)))
        better = (after <= before)[..., None]
        R, t = np.where(better[..., None], R_new, R), np.where(better, t_new, t)  # pyright: ignore[reportConstantRedefinition]
    return R, t


def distances(view: RayObservations, chosen: Mask, R: Array, t: Array) -> Array:
    """(b, n) squared residuals over their variances for points of unit variance, given the pose of the chosen points.

    H = J C J^T is the pose's share of the variance. A point that took no part scatters by 1 + H; one that did by
    1 - H, and over 1 - H its square is the one that it would have, had it taken no part.
    """
    residual, slope = _linear(view, R, t)
    share = slope @ _covariance(slope, chosen)[..., None, :, :] @ np.swapaxes(slope, -1, -2)
    sign = np.where(chosen, -1.0, 1.0)
    a, b, d = 1.0 + sign * share[..., 0, 0], sign * share[..., 0, 1], 1.0 + sign * share[..., 1, 1]
    u, v = residual[..., 0], residual[..., 1]
    distance = (d * u * u - 2.0 * b * u * v + a * v * v) / (a * d - b * b)
    return np.where(np.isfinite(distance) & (distance >= 0.0), distance, np.inf)


def _chosen(values: Array, chosen: Mask) -> Array:
    """Values (b, n, ., .) of chosen points that are finite, else 0."""
    return np.where(chosen[..., None, None] & np.isfinite(values), values, 0.0)


def _covariance(slope: Array, chosen: Mask) -> Array:
    """(b, 6, 6) inverse of the information of the chosen points, for points of unit variance."""
    stacked = _chosen(slope, chosen).reshape(*slope.shape[:-3], -1, 6)
    normal = np.swapaxes(stacked, -1, -2) @ stacked
    scale = np.sqrt(np.maximum(np.einsum("...ii->...i", normal), 1e-300))
    outer = scale[..., :, None] * scale[..., None, :]
    return np.linalg.inv(normal / outer + RIDGE * np.eye(6)) / outer
