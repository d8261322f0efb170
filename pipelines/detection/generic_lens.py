"""Compiled kernels of a camera whose lens is not known: a pose and a radial polynomial, fitted to one board.

The seven numbers of a lens, in order: focal length f, px; aspect a; centre cx, cy, px; k1, k2, k3. A ray at angle
theta meets the picture at radius f theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6), times 1 + a along y.
One view of a flat board does not tell all of them apart (a longer lens farther away looks much the same), but what
they predict between and beside the corners is good to the noise of the corners: the image of a board that faces the
camera, turns away from it or fills half of a fish-eye picture differs from it by less than 0.001 px.

Source:
    Kannala and Brandt 2006, A generic camera model, equation 6.
"""

from __future__ import annotations

import math

import numpy as np

from eposit.arrays import Array
from pipelines.detection.cholesky import solve_damped
from pipelines.detection.kernels import compiled, compiled_part

LENS = 7
PARAMETERS = 6 + LENS  # rotation 3, translation 3, lens
NEWTON_STEPS = 12
TRIES = 8
LEAST_GAIN = 1e-4  # of the cost in one step: a hundredth of a corner; a pinhole would wander for a hundred steps


@compiled
def project(R: Array, t: Array, lens: Array, x: Array, y: Array, z: Array, out: Array) -> None:
    """Points (n,), (n,), (n,) in the board's frame to (n, 2) px in `out`."""
    f, aspect, cx, cy, k1, k2, k3 = lens
    for i in range(len(x)):
        u = R[0, 0] * x[i] + R[0, 1] * y[i] + R[0, 2] * z[i] + t[0]
        v = R[1, 0] * x[i] + R[1, 1] * y[i] + R[1, 2] * z[i] + t[1]
        w = R[2, 0] * x[i] + R[2, 1] * y[i] + R[2, 2] * z[i] + t[2]
        side = math.hypot(u, v)
        theta = math.atan2(side, w)
        t2 = theta * theta
        scale = f * theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * k3))) / max(side, 1e-12)
        out[i, 0] = cx + scale * u
        out[i, 1] = cy + scale * v * (1.0 + aspect)


@compiled_part
def _changed(R: Array, t: Array, lens: Array, change: Array, R_out: Array, t_out: Array, lens_out: Array) -> None:
    """R with the rotation vector `change[:3]` applied on the left; t and lens with the rest added.

    Source:
        Rodrigues' formula.
    """
    a, b, c = change[0], change[1], change[2]
    square = a * a + b * b + c * c
    angle = math.sqrt(square)
    sine, cosine = (1.0, 0.5) if angle < 1e-9 else (math.sin(angle) / angle, (1.0 - math.cos(angle)) / square)
    for k in range(3):
        x, y, z = R[0, k], R[1, k], R[2, k]
        along = a * x + b * y + c * z
        R_out[0, k] = x + sine * (b * z - c * y) + cosine * (a * along - square * x)
        R_out[1, k] = y + sine * (c * x - a * z) + cosine * (b * along - square * y)
        R_out[2, k] = z + sine * (a * y - b * x) + cosine * (c * along - square * z)
        t_out[k] = t[k] + change[3 + k]
    for k in range(len(lens)):
        lens_out[k] = lens[k] + change[6 + k]


@compiled_part
def _copy_pose(R: Array, t: Array, lens: Array, R_out: Array, t_out: Array, lens_out: Array) -> None:
    for k in range(3):
        t_out[k] = t[k]
        for m in range(3):
            R_out[k, m] = R[k, m]
    for k in range(len(lens)):
        lens_out[k] = lens[k]


@compiled
def slopes(R: Array, t: Array, lens: Array, x: Array, y: Array, z: Array, out: Array) -> None:
    """(2 n, 13) change of the pixels of points in the board's frame for a change of each parameter.

    In order: a rotation vector on the left of R, the translation, the lens.
    """
    f, aspect, _, _, k1, k2, k3 = lens
    for i in range(len(x)):
        a = R[0, 0] * x[i] + R[0, 1] * y[i] + R[0, 2] * z[i]
        b = R[1, 0] * x[i] + R[1, 1] * y[i] + R[1, 2] * z[i]
        c = R[2, 0] * x[i] + R[2, 1] * y[i] + R[2, 2] * z[i]
        u, v, w = a + t[0], b + t[1], c + t[2]
        side = max(math.hypot(u, v), 1e-12)
        theta, square = math.atan2(side, w), side * side + w * w
        t2 = theta * theta
        radius = f * theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * k3)))
        rise = f * (1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * 7.0 * k3))) / square
        cosine, sine, along, around = u / side, v / side, rise * w, radius / side
        for k in range(2):
            stretch = 1.0 + aspect if k == 1 else 1.0
            same, other = (cosine, sine) if k == 0 else (sine, cosine)
            mixed, own = same * other * (along - around), same * same * along + other * other * around
            du, dv = (own, mixed) if k == 0 else (mixed, own)
            dw = -same * rise * side
            row = 2 * i + k
            out[row, 0], out[row, 1], out[row, 2] = b * dw - c * dv, c * du - a * dw, a * dv - b * du
            out[row, 3], out[row, 4], out[row, 5] = du, dv, dw
            out[row, 6] = radius / f * same
            out[row, 7] = radius * same * k / stretch
            out[row, 8], out[row, 9] = 1.0 - k, k / stretch
            power = f * theta * same
            for degree in range(3):
                power *= t2
                out[row, 10 + degree] = power
            for column in range(PARAMETERS):
                out[row, column] *= stretch


@compiled_part
def _cost(pixels: Array, found: Array, weights: Array, lens: Array, held: Array) -> float:
    total = 0.0
    for i in range(len(pixels)):
        total += weights[i] * ((pixels[i, 0] - found[i, 0]) ** 2 + (pixels[i, 1] - found[i, 1]) ** 2)
    for k in range(1, 7):
        total += held[1, k] * (lens[k] - held[0, k]) ** 2
    return total


@compiled_part
def _normal_equations(
    jacobian: Array, pixels: Array, found: Array, weights: Array, normal: Array, right: Array
) -> None:
    """Lower triangle of J^T W J in `normal` and J^T W r in `right`."""
    for a in range(PARAMETERS):
        right[a] = 0.0
        for b in range(a + 1):
            normal[a, b] = 0.0
    for i in range(len(pixels)):
        for k in range(2):
            row, residual = 2 * i + k, pixels[i, k] - found[i, k]
            for a in range(PARAMETERS):
                weighted = weights[i] * jacobian[row, a]
                right[a] += weighted * residual
                for b in range(a + 1):
                    normal[a, b] += weighted * jacobian[row, b]


@compiled
def fit(
    R: Array, t: Array, lens: Array, points: Array, pixels: Array, weights: Array, held: Array, steps: int
) -> tuple[Array, Array, Array]:
    """Levenberg-Marquardt over pose and lens on (n, 2) pixels of points of the board.

    points: (3, n) x, y, z. weights: (n,) inverse variances, 0 where a point takes no part. held: (2, 7) a
    usual lens, and weak weights that keep the lens near it, for what one view does not tell.
    """
    x, y, z = points[0], points[1], points[2]
    n, R_old, t_old, lens_old = len(x), R, t, lens
    R, t, lens = np.empty((3, 3)), np.empty(3), np.empty(len(lens_old))
    _copy_pose(R_old, t_old, lens_old, R, t, lens)
    R_new, t_new, lens_new = np.empty((3, 3)), np.empty(3), np.empty(len(lens))
    found, trial, jacobian = np.empty((n, 2)), np.empty((n, 2)), np.empty((2 * n, PARAMETERS))
    normal, lower = np.empty((PARAMETERS, PARAMETERS)), np.empty((PARAMETERS, PARAMETERS))
    right, change = np.empty(PARAMETERS), np.empty(PARAMETERS)
    project(R, t, lens, x, y, z, found)
    cost, damping = _cost(pixels, found, weights, lens, held), 1e-3
    for _ in range(steps):
        slopes(R, t, lens, x, y, z, jacobian)
        _normal_equations(jacobian, pixels, found, weights, normal, right)
        for k in range(1, 7):
            normal[6 + k, 6 + k] += held[1, k]
            right[6 + k] -= held[1, k] * (lens[k] - held[0, k])
        gain = 0.0
        for _ in range(TRIES):
            new = np.inf
            if solve_damped(normal, right, damping, lower, change):
                _changed(R, t, lens, change, R_new, t_new, lens_new)
                project(R_new, t_new, lens_new, x, y, z, trial)
                new = _cost(pixels, trial, weights, lens_new, held)
            if new <= cost:
                gain = (cost - new) / cost if cost > 0.0 else 0.0
                _copy_pose(R_new, t_new, lens_new, R, t, lens)
                found, trial = trial, found
                cost, damping = new, 0.1 * damping if damping > 1e-8 else 1e-9
                break
            damping *= 10.0
        if gain < LEAST_GAIN:
            break
    return R, t, lens


@compiled
def meet_planes(R: Array, t: Array, lens: Array, x: Array, y: Array, heights: Array, out: Array) -> None:
    """Where the rays of pixels at columns x (w,) and rows y (h,) meet planes parallel to the board.

    heights: (k,) z of the planes. out: (k, 2, h, w) board coordinates.
    """
    f, aspect, cx, cy, k1, k2, k3 = lens
    ox = -(R[0, 0] * t[0] + R[1, 0] * t[1] + R[2, 0] * t[2])
    oy = -(R[0, 1] * t[0] + R[1, 1] * t[1] + R[2, 1] * t[2])
    oz = -(R[0, 2] * t[0] + R[1, 2] * t[1] + R[2, 2] * t[2])
    for row in range(len(y)):
        theta = 0.0
        for column in range(len(x)):
            u, v = (x[column] - cx) / f, (y[row] - cy) / f / (1.0 + aspect)
            radius = math.hypot(u, v)
            if column == 0:
                theta = radius
            for _ in range(NEWTON_STEPS):
                t2 = theta * theta
                value = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * k3))) - radius
                step = value / (1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * 7.0 * k3)))
                theta -= step
                if abs(step) < 1e-10:
                    break
            side = math.sin(theta) / max(radius, 1e-12)
            a, b, c = u * side, v * side, math.cos(theta)
            dx = R[0, 0] * a + R[1, 0] * b + R[2, 0] * c
            dy = R[0, 1] * a + R[1, 1] * b + R[2, 1] * c
            dz = R[0, 2] * a + R[1, 2] * b + R[2, 2] * c
            for k in range(len(heights)):
                reach = (heights[k] - oz) / dz
                out[k, 0, row, column] = ox + reach * dx
                out[k, 1, row, column] = oy + reach * dy


def prepare() -> None:
    """Call each compiled function once."""
    R, t, at = np.eye(3), np.array([0.0, 0.0, 5.0]), np.arange(2.0)
    lens = np.array([100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    project(R, t, lens, at, at, at, np.empty((2, 2)))
    slopes(R, t, lens, at, at, at, np.empty((4, PARAMETERS)))
    meet_planes(R, t, lens, at, at, at, np.empty((2, 2, 2, 2)))
    fit(R, t, lens, np.zeros((3, 2)), np.zeros((2, 2)), np.ones(2), np.ones((2, LENS)), 1)
