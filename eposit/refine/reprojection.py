"""Reprojection of a batch of poses: residuals, gradient and information matrix, problems last.

Poses are R (3, 3, b) and t (3, b), points (n, 3, b): the long axis is last, so that one NumPy call works on one number
of every problem, in the cache. A pose changes by a rotation vector applied on the left in the camera frame (rad),
then a translation: six numbers in this order.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from eposit.arrays import Array
from eposit.camera import Camera


@dataclass(frozen=True, slots=True)
class Observations:
    """b images of the same n points, with their weights."""

    camera: Camera
    points_in_obj: Array  # (n, 3)
    seen: Array  # (n, 2, b) image points over focal length, from the principal point
    factor: Array  # (n, 2, 2) whitening times focal lengths
    diagonal: Array | None  # (n, 2, 1), the factor's diagonal where it has nothing else

    @staticmethod
    def of(camera: Camera, points_in_obj: Array, points_px: Array, weights: Array) -> Observations:
        """From (b, n, 2) px and (2, 2, n) whitening."""
        seen = np.array(points_px.transpose(1, 2, 0), order="C")
        seen -= np.array([[camera.cx], [camera.cy]])
        seen *= np.array([[1.0 / camera.fx], [1.0 / camera.fy]])
        factor = weights.transpose(2, 0, 1) * np.array([camera.fx, camera.fy])
        crossed = np.any(factor[:, 0, 1]) or np.any(factor[:, 1, 0])
        diagonal = None if crossed else np.ascontiguousarray(factor[:, [0, 1], [0, 1]])[..., None]
        return Observations(camera, points_in_obj, seen, factor, diagonal)

    def whiten(self, values: Array) -> Array:
        """Whitened px of (n, 2, b) values."""
        return values * self.diagonal if self.diagonal is not None else np.einsum("nac,ncb->nab", self.factor, values)


@dataclass(frozen=True, slots=True)
class Equations:
    """The quadratic model of the cost at b poses."""

    cost: Array  # (b,) sum of squared residuals, infinite where a point cannot be projected
    gradient: Array  # (6, b) J^T r
    normal: Array  # (6, 6, b) J^T J, upper triangle


def cost(residual: Array) -> Array:
    """(b,) sums of the squares of (n, 2, b) residuals; infinite where they are not finite."""
    total = np.einsum("nab,nab->b", residual, residual)
    return np.where(np.isfinite(total), total, np.inf)


def equations(view: Observations, R: Array, t: Array) -> Equations:
    """Cost, gradient and information matrix."""
    residual, rows = residuals_and_slopes(view, R, t)
    slope = np.einsum("kb,kib->ib", residual.reshape(*rows.shape[::2]), rows)
    return Equations(cost(residual), slope, upper_normal(rows))


def residuals_and_slopes(view: Observations, R: Array, t: Array) -> tuple[Array, Array]:
    """Whitened residuals (n, 2, b) and their slopes (2 n, 6, b) by the pose."""
    arm = np.einsum("nj,ijb->nib", view.points_in_obj, R)
    n, _, b = arm.shape
    point = arm + t
    scale, forward, bend = _radial(view.camera, point)
    side = point[:, :2]
    residual = view.whiten(side * scale[:, None] - view.seen)
    jacobian = np.empty((n, 2, 6, b))
    _fill_slopes(view, jacobian[:, :, 3:], side, scale, forward, bend)
    fill_turn_slopes(jacobian, arm)
    return residual, jacobian.reshape(2 * n, 6, b)


def fill_turn_slopes(jacobian: Array, arm: Array) -> None:
    """Slopes by a rotation vector on the left, from those by the translation.

    jacobian: (n, 2, 6, b) with the slopes by the translation in [:, :, 3:]; [:, :, :3] is written. arm: (n, 3, b)
    turned points, without the translation.
    """
    lever = arm[:, None]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(lever[:, :, j], jacobian[:, :, 3 + k], out=jacobian[:, :, i])
        jacobian[:, :, i] -= lever[:, :, k] * jacobian[:, :, 3 + j]


def upper_normal(rows: Array) -> Array:
    """(6, 6, b) J^T J of (m, 6, b) rows of J; the upper triangle, the rest is not written."""
    normal = np.empty((6, 6, rows.shape[-1]))
    for i in range(6):
        np.einsum("kb,kjb->jb", rows[:, i], rows[:, i:], out=normal[i, i:])
    return normal


def _fill_slopes(view: Observations, out: Array, side: Array, scale: Array, forward: Array, bend: Array | None) -> None:
    """Whitened derivatives of the projections by the camera coordinates, (n, 2, 3, b)."""
    if view.diagonal is None:
        plain = np.empty_like(out)
        _fill_slopes(replace(view, diagonal=np.ones((1, 2, 1))), plain, side, scale, forward, bend)
        np.einsum("nac,ncib->naib", view.factor, plain, out=out)
        return
    wide, high = view.diagonal[:, 0], view.diagonal[:, 1]
    np.multiply(forward[:, None], side * view.diagonal, out=out[:, :, 2])
    if bend is None:
        out[:, 0, 1] = out[:, 1, 0] = 0.0
        np.multiply(scale, wide, out=out[:, 0, 0])
        np.multiply(scale, high, out=out[:, 1, 1])
        return
    x, y = side[:, 0], side[:, 1]
    crossed = x * y * bend
    out[:, 0, 1], out[:, 1, 0] = wide * crossed, high * crossed
    out[:, 0, 0], out[:, 1, 1] = wide * (scale + x * x * bend), high * (scale + y * y * bend)


def _radial(camera: Camera, point: Array) -> tuple[Array, Array, Array | None]:
    """The projection x scale, y scale of (n, 3, b) points and its derivatives, each (n, b).

    They are scale I + bend (x, y) (x, y)^T by x and y, and forward (x, y) by z; bend is None where it is zero. The
    lens law is continued smoothly past theta_max, so that a step may cross it; past a pole scale is infinite.
    """
    x, y, z = point[:, 0], point[:, 1], point[:, 2]
    if camera.lens == "perspective":
        scale = 1.0 / z
        if not np.all(z > 0.0):  # nothing lies at or beyond 90 degrees
            scale = np.where(z > 0.0, scale, np.inf)
        return scale, -scale * scale, None
    law = camera.law
    side2 = x * x + y * y
    side = np.sqrt(side2)
    theta = np.arctan2(side, z)
    if np.isinf(law.rho_max):  # a pole at theta_max: nothing lies beyond it
        theta = np.where(theta < law.theta_max, theta, np.nan)
    on_axis = side == 0.0
    scale = np.where(on_axis, law.raw_slope(np.zeros(())) / z, law.raw_rho(theta) / np.where(on_axis, 1.0, side))
    scale = np.where(np.isnan(scale), np.inf, scale)
    forward = -law.raw_slope(theta) / (side2 + z * z)
    bend = np.where(on_axis, 0.0, -(forward * z + scale) / np.where(on_axis, 1.0, side2))
    return scale, forward, bend
