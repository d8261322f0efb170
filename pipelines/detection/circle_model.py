"""Compiled least squares of the raised circle: a dark disc over a board on which it casts its shade.

On a grid finer than the pixels, the picture is k D + (1 - D) (w + g . x - A b - L s): the disc D with grey k over
white w with a slope g, of which the disc blocks a share b of the surroundings' light, and the lamp's shadow s, a disc
of the same size, displaced and with a soft rim. It is blurred by a gaussian and sampled at the pixels. k, w, g, A and L
are linear and solved along; disc and shadow are moved by Levenberg-Marquardt.

Where the disc's rim lies in its own shade, no edge can be seen; the model knows that and takes the place from the rest.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.erf import GAUSS, REORDER, decay, signed_share

Places = NDArray[np.intp]
# Numbers of a fit, in order: disc x, y, in radii from where it is expected, and its size as a ratio; shadow x, y from
# the foot and the softness of its rim, in radii; then k, w, gx, gy (per radius), A, L in grey values.
SHAPE, LINEAR = 6, 6
SIZE, SOFTNESS, CONTRAST_FROM, CONTRAST_TO = 2, 5, 7, 6
FURTHEST_STEP = np.array([0.15, 0.15, 0.02, 0.15, 0.15, 0.05])  # in one iteration
SOFTNESS_LIMITS = (0.01, 0.6)
ROUNDING = 1.0 / 12.0  # variance of a grey value that was rounded: no picture is better known


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _open_share(v: Array, p: Array, per_px: Array, finer: int, out: Array, slopes: Array) -> None:
    """Share of each fine cell that the disc leaves open, and its change with the disc's x, y and size (3, h, w).

    v: (2, h, w) places on its plane, radii from its centre.
    """
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            a, b = v[0, i, j] - p[0], v[1, i, j] - p[1]
            radius = math.sqrt(a * a + b * b) + 1e-12
            across = (per_px[0, 0] * a + per_px[1, 0] * b) / radius
            down = (per_px[0, 1] * a + per_px[1, 1] * b) / radius
            per_radius = finer / math.sqrt(across * across + down * down)  # fine cells
            beyond = (radius - p[2]) * per_radius
            out[i, j] = min(max(0.5 + beyond, 0.0), 1.0)
            slope = -per_radius if abs(beyond) < 0.5 else 0.0
            slopes[0, i, j], slopes[1, i, j], slopes[2, i, j] = slope * a / radius, slope * b / radius, slope


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _shadow(u: Array, p: Array, out: Array, slopes: Array) -> None:
    """Share of the lamp that is hidden, and its change with the shadow's x, y and softness (3, h, w).

    u: (2, h, w) places on the board, radii from the disc's foot.
    """
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            a, b = u[0, i, j] - p[3], u[1, i, j] - p[4]
            radius = math.sqrt(a * a + b * b) + 1e-12
            beyond = (radius - 1.0) / p[5]
            bell = decay(0.5 * beyond * beyond)
            out[i, j] = 0.5 - 0.5 * signed_share(beyond, bell)
            slope = 0.5 * GAUSS * bell / p[5]
            slopes[0, i, j], slopes[1, i, j], slopes[2, i, j] = slope * a / radius, slope * b / radius, slope * beyond


@njit(cache=True, fastmath=REORDER)
def _blurred(fine: Array, kernel: Array, finer: int, rows: Places, columns: Places, held: Array, out: Array) -> None:
    """Separable blur of a fine grid, sampled at the pixels (n,), (n,) of the patch into `out` (n,).

    held: (pixels along y, width of the grid and twice as many cells as the kernel has taps).
    """
    taps, width = len(kernel), fine.shape[1]
    first = (finer - taps) // 2
    for i in range(held.shape[0]):
        line = held[i, taps : taps + width]
        line[:] = 0.0
        for k in range(taps):
            cells = fine[min(max(finer * i + first + k, 0), fine.shape[0] - 1)]
            for j in range(width):
                line[j] += kernel[k] * cells[j]
        held[i, :taps], held[i, taps + width :] = line[0], line[-1]  # the grid goes on as it ends
    for n in range(len(out)):
        begin, total = finer * columns[n] + first + taps, 0.0
        cells = held[rows[n], begin : begin + taps]
        for k in range(taps):
            total += kernel[k] * cells[k]
        out[n] = total


@njit(cache=True)
def fit_disc(
    grey: Array,
    rows: Places,
    columns: Places,
    u: Array,
    v: Array,
    fields: Array,
    per_px: Array,
    kernel: Array,
    finer: int,
    start: Array,
    expected: Array,
    spread: Array,
    furthest: float,
    steps: int,
    stop: float,
) -> tuple[Array, Array, float, bool]:
    """Fit one disc.

    grey: (n,) values of the pixels at rows, columns (n,) of the patch. u, v: (2, h, w) places of the fine grid on the
    board and on the disc's plane, in radii. fields: (3, h, w) slopes x, y in radii and the blocked share. per_px:
    (2, 2) radii per px. kernel: (k,) taps of the blur on the fine grid, `finer` cells to a pixel. start: (6,) shape.
    expected, spread: (12,) what is known beforehand, as mean and standard deviation. furthest: of the shadow, radii.
    stop: step, in standard deviations of what is fitted, at which it has converged.

    Returns:
        (12,) the fit, (12, 12) covariance, standard deviation of the residuals where they tell the place, convergence.
    """
    total, n, fine = SHAPE + LINEAR, len(grey), fields.shape[1:]
    opened, shade, under, product = np.empty(fine), np.empty(fine), np.empty(fine), np.empty(fine)
    rim, edge = np.empty((3, *fine)), np.empty((3, *fine))  # changes of the disc and of its shadow
    held, column = np.empty((fine[0] // finer, fine[1] + 2 * len(kernel))), np.empty(n)
    basis, jacobian = np.empty((n, LINEAR)), np.empty((n, total))
    p, trial = np.zeros(total), np.zeros(total)
    trial[:SHAPE] = start
    normal, right = np.eye(total), np.zeros(total)
    cost, damping, noise, converged = -1.0, 1e-3, 4.0, False
    for _ in range(steps):
        _open_share(v, trial, per_px, finer, opened, rim)
        _shadow(u, trial, shade, edge)
        _blurred(opened, kernel, finer, rows, columns, held, column)
        basis[:, 0], basis[:, 1] = 1.0 - column, column
        for k in range(4):
            if k < 2:
                product[:] = opened * fields[k]
            else:
                product[:] = -opened * (fields[2] if k == 2 else shade)
            _blurred(product, kernel, finer, rows, columns, held, column)
            basis[:, 2 + k] = column
        weigh = noise / spread**2
        square, side = basis.T @ basis, basis.T @ grey
        for k in range(LINEAR):
            square[k, k] += weigh[SHAPE + k] + 1e-9 * square[k, k]
            side[k] += weigh[SHAPE + k] * expected[SHAPE + k]
        trial[SHAPE:] = np.linalg.solve(square, side)
        residual = grey - basis @ trial[SHAPE:]
        new = np.dot(residual, residual) + np.sum(weigh * (trial - expected) ** 2)
        if cost >= 0.0 and new > cost:
            damping *= 10.0
        else:
            p[:] = trial
            damping = max(0.1 * damping, 1e-9)
            under[:] = p[7] - p[6] + p[8] * fields[0] + p[9] * fields[1] - p[10] * fields[2] - p[11] * shade
            for k in range(SHAPE):
                product[:] = rim[k] * under if k < 3 else edge[k - 3] * opened * -p[11]
                _blurred(product, kernel, finer, rows, columns, held, column)
                jacobian[:, k] = column
            jacobian[:, SHAPE:] = basis
            told = jacobian[:, 0] ** 2 + jacobian[:, 1] ** 2
            noise = max(np.sum(told * residual**2) / max(np.sum(told), 1e-300) * n / (n - total), ROUNDING)
            weigh = noise / spread**2
            normal, right = jacobian.T @ jacobian, jacobian.T @ residual - weigh * (p - expected)
            for k in range(total):
                normal[k, k] += weigh[k] + 1e-12 * normal[k, k]
            cost = np.dot(residual, residual) + np.sum(weigh * (p - expected) ** 2)
        damped = normal.copy()
        for k in range(SHAPE):
            damped[k, k] += damping * normal[k, k]
        step = np.linalg.solve(damped, right)
        if np.dot(right, step) <= stop * stop * noise:
            p[:SHAPE] += step[:SHAPE]
            converged = True
            break
        trial[:] = p
        for k in range(SHAPE):
            trial[k] += min(max(step[k], -FURTHEST_STEP[k]), FURTHEST_STEP[k])
        trial[3] = min(max(trial[3], -furthest), furthest)
        trial[4] = min(max(trial[4], -furthest), furthest)
        trial[SOFTNESS] = min(max(trial[SOFTNESS], SOFTNESS_LIMITS[0]), SOFTNESS_LIMITS[1])
    return p, np.linalg.inv(normal) * noise, math.sqrt(noise), converged
