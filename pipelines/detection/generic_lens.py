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
from numba import njit

from eposit.arrays import Array

PARAMETERS = 13  # rotation 3, translation 3, lens 7
NEWTON_STEPS = 12
TRIES = 8
LEAST_GAIN = 1e-4  # of the cost in one step: a hundredth of a corner; a pinhole would wander for a hundred steps


@njit(cache=True)
def project(R: Array, t: Array, lens: Array, x: Array, y: Array, z: float, out: Array) -> None:
    """Points (n,), (n,) on the plane z of the board to (n, 2) px in `out`."""
    f, aspect, cx, cy, k1, k2, k3 = lens
    for i in range(len(x)):
        u = R[0, 0] * x[i] + R[0, 1] * y[i] + R[0, 2] * z + t[0]
        v = R[1, 0] * x[i] + R[1, 1] * y[i] + R[1, 2] * z + t[1]
        w = R[2, 0] * x[i] + R[2, 1] * y[i] + R[2, 2] * z + t[2]
        side = math.hypot(u, v)
        theta = math.atan2(side, w)
        t2 = theta * theta
        scale = f * theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * k3))) / max(side, 1e-12)
        out[i, 0] = cx + scale * u
        out[i, 1] = cy + scale * v * (1.0 + aspect)


@njit(cache=True)
def _turned(vector: Array, R: Array) -> Array:
    """R with a rotation vector (3,) applied on the left."""
    angle = math.sqrt(vector[0] ** 2 + vector[1] ** 2 + vector[2] ** 2)
    cross = np.array([[0.0, -vector[2], vector[1]], [vector[2], 0.0, -vector[0]], [-vector[1], vector[0], 0.0]])
    if angle < 1e-9:
        return R + cross @ R
    return R + (math.sin(angle) / angle * cross + (1.0 - math.cos(angle)) / angle**2 * (cross @ cross)) @ R


@njit(cache=True)
def _changed(R: Array, t: Array, lens: Array, change: Array) -> tuple[Array, Array, Array]:
    return _turned(change[:3], R), t + change[3:6], lens + change[6:]


@njit(cache=True)
def slopes(R: Array, t: Array, lens: Array, x: Array, y: Array, out: Array) -> None:
    """(2 n, 13) change of the pixels of points on the board for a change of each parameter.

    In order: a rotation vector on the left of R, the translation, the lens.
    """
    f, aspect, _, _, k1, k2, k3 = lens
    stretch = np.array([1.0, 1.0 + aspect])
    for i in range(len(x)):
        arm = R[:, 0] * x[i] + R[:, 1] * y[i]
        u, v, w = arm[0] + t[0], arm[1] + t[1], arm[2] + t[2]
        side = max(math.hypot(u, v), 1e-12)
        theta, square = math.atan2(side, w), side * side + w * w
        t2 = theta * theta
        radius = f * theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * k3)))
        rise = f * (1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * 7.0 * k3))) / square
        cosine, sine, along, around = u / side, v / side, rise * w, radius / side
        for k in range(2):
            same, other = (cosine, sine) if k == 0 else (sine, cosine)
            mixed, own = same * other * (along - around), same * same * along + other * other * around
            du, dv = (own, mixed) if k == 0 else (mixed, own)
            dw = -same * rise * side
            row = out[2 * i + k]
            row[0], row[1], row[2] = arm[1] * dw - arm[2] * dv, arm[2] * du - arm[0] * dw, arm[0] * dv - arm[1] * du
            row[3], row[4], row[5] = du, dv, dw
            row[6] = radius / f * same
            row[7] = radius * same * k / stretch[1]
            row[8], row[9] = 1.0 - k, float(k) / stretch[1]
            power = f * theta * same
            for degree in range(3):
                power *= t2
                row[10 + degree] = power
            for column in range(PARAMETERS):
                row[column] *= stretch[k]


@njit(cache=True)
def _cost(pixels: Array, found: Array, weights: Array, lens: Array, expected: Array, hold: Array) -> float:
    total = 0.0
    for i in range(len(pixels)):
        total += weights[i] * ((pixels[i, 0] - found[i, 0]) ** 2 + (pixels[i, 1] - found[i, 1]) ** 2)
    for k in range(1, 7):
        total += hold[k] * (lens[k] - expected[k]) ** 2
    return total


@njit(cache=True)
def fit(
    R: Array, t: Array, lens: Array, x: Array, y: Array, pixels: Array, weights: Array, hold: Array, steps: int
) -> tuple[Array, Array, Array]:
    """Levenberg-Marquardt over pose and lens on (n, 2) pixels of points (n,), (n,) of the board.

    weights: (n,) inverse variances, 0 where a point takes no part. hold: (7,) weak weights that keep the lens near
    where it starts, for what one view does not tell.
    """
    n, expected = len(x), lens.copy()
    found, trial = np.empty((n, 2)), np.empty((n, 2))
    jacobian, residual, scale = np.empty((2 * n, PARAMETERS)), np.empty(2 * n), np.empty(2 * n)
    for i in range(n):
        scale[2 * i] = scale[2 * i + 1] = math.sqrt(weights[i])
    project(R, t, lens, x, y, 0.0, found)
    cost, damping = _cost(pixels, found, weights, lens, expected, hold), 1e-3
    for _ in range(steps):
        slopes(R, t, lens, x, y, jacobian)
        for i in range(2 * n):
            residual[i] = (pixels[i // 2, i % 2] - found[i // 2, i % 2]) * scale[i]
            jacobian[i] *= scale[i]
        normal, gradient = jacobian.T @ jacobian, jacobian.T @ residual
        for k in range(1, 7):
            normal[6 + k, 6 + k] += hold[k]
            gradient[6 + k] -= hold[k] * (lens[k] - expected[k])
        gain = 0.0
        for _ in range(TRIES):
            damped = normal.copy()
            for k in range(PARAMETERS):
                damped[k, k] += damping * normal[k, k] + 1e-30
            proposal = _changed(R, t, lens, np.linalg.solve(damped, gradient))
            project(proposal[0], proposal[1], proposal[2], x, y, 0.0, trial)
            new = _cost(pixels, trial, weights, proposal[2], expected, hold)
            if new <= cost:
                gain = (cost - new) / max(cost, 1e-300)
                R, t, lens = proposal
                found[:] = trial
                cost, damping = new, max(0.1 * damping, 1e-9)
                break
            damping *= 10.0
        if gain < LEAST_GAIN:
            break
    return R, t, lens


@njit(cache=True)
def meet_planes(R: Array, t: Array, lens: Array, x: Array, y: Array, heights: Array, out: Array) -> None:
    """Where the rays of pixels at columns x (w,) and rows y (h,) meet planes parallel to the board.

    heights: (k,) z of the planes. out: (k, 2, h, w) board coordinates.
    """
    f, aspect, cx, cy, k1, k2, k3 = lens
    origin = -(R.T @ t)
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
                reach = (heights[k] - origin[2]) / dz
                out[k, 0, row, column] = origin[0] + reach * dx
                out[k, 1, row, column] = origin[1] + reach * dy
