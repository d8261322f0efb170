"""Compiled least squares of chessboard corners: the picture of `corner_picture` that is nearest to the pixels."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.cholesky import solve_damped
from pipelines.detection.corner_picture import (
    BLUR,
    CONTRAST,
    MEAN,
    SHAPE,
    SLOPE,
    CornerPixels,
    CornerTask,
    draw,
    gather,
    start_levels,
)  # fmt: skip
from pipelines.detection.corner_profiles import EdgeProfile
from pipelines.detection.kernels import compiled, compiled_part, inlined

BLUR_LIMITS_PX = (0.2956, 8.0)  # no picture is sharper than its pixels' own area
LEAST_NOISE = 0.04  # variance, grey levels^2: half of what rounding to whole grey levels leaves
FURTHEST_STEP = (0.7, 0.7, 0.15, 0.15, 0.4)  # of the first numbers in one iteration; the others are linear
LEAST_PIXELS = 14  # five more than a shape has numbers: squares of 4 px have them
SPOILED_NOISES = 25.0  # variances of the noise that the square of a residual must exceed to be no noise
LEAST_SPOILED = 20.0  # grey levels that it must exceed
MOST_TOGETHER = 2  # of it and its neighbours that lie half as far off to its side: three are the edge of something
MOST_SPOILED = 10  # single pixels of a corner that are left out


class CornerFits(NamedTuple):
    """What comes of it; NaN where a corner has too few pixels."""

    shapes: Array  # (n, 9) with the corner in px of the image
    covariances: Array  # (n, 2, 2) px^2, for noise of one grey level
    noises: Array  # (n,) variance of the noise that the pixels on the edges show, grey levels^2
    converged: Mask  # (n,)


class _System(NamedTuple):
    """Workspace: the normal equations of one corner, and what they are solved for."""

    normal: Array  # (9, 9)
    lower: Array  # (9, 9)
    right: Array  # (9,)
    step: Array  # (9,)
    trial: Array  # (9,) shape


def fit_corners(image: NDArray[np.float32], task: CornerTask, steps: int, stop: float) -> CornerFits:
    """Fit every corner by Levenberg and Marquardt.

    image: (height, width) light. stop: step, in standard deviations of what is fitted, at which it has converged.
    """
    count, most = len(task.starts), (2 * int(np.max(task.windows, initial=0)) + 1) ** 2
    fits = CornerFits(
        np.full((count, SHAPE), np.nan), np.full((count, 2, 2), np.nan), np.full(count, np.nan), np.zeros(count, bool)
    )
    first, second = (EdgeProfile(*(np.empty(most) for _ in EdgeProfile._fields)) for _ in range(2))
    pixels = CornerPixels(
        np.empty(most), np.empty(most), np.empty(most), np.empty(most), np.empty((SHAPE, most)), first, second
    )
    system = _System(
        np.empty((SHAPE, SHAPE)), np.empty((SHAPE, SHAPE)), np.empty(SHAPE), np.empty(SHAPE), np.empty(SHAPE)
    )
    _fit_all(image, task, steps, stop, fits, pixels, system)
    return fits


@inlined
def _clipped(value: float, low: float, high: float) -> float:
    return low if value < low else high if value > high else value


@inlined
def _copy(values: Array, out: Array) -> None:
    for k in range(len(values)):  # an assignment to a slice takes seconds to compile
        out[k] = values[k]


@compiled_part
def _product(first: Array, second: Array, n: int) -> float:
    """Sum of the products of n numbers, in four sums side by side: one alone would wait for each addition."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    whole = n - n % 4
    for i in range(0, whole, 4):
        a += first[i] * second[i]
        b += first[i + 1] * second[i + 1]
        c += first[i + 2] * second[i + 2]
        d += first[i + 3] * second[i + 3]
    for i in range(whole, n):
        a += first[i] * second[i]
    return (a + b) + (c + d)


@inlined
def _normal_equations(jacobian: Array, residual: Array, n: int, normal: Array, right: Array) -> None:
    """Lower triangle of J J^T in `normal` and J r in `right`."""
    for a in range(SHAPE):
        right[a] = _product(jacobian[a], residual, n)
        for b in range(a + 1):
            normal[a, b] = _product(jacobian[a], jacobian[b], n)


@inlined
def _noise(jacobian: Array, residual: Array, n: int) -> float:
    """Variance of the residuals, each weighed by what its pixel says of the position."""
    square, total = 0.0, 0.0
    for i in range(n):
        weight = jacobian[0, i] ** 2 + jacobian[1, i] ** 2
        square += weight * residual[i] ** 2
        total += weight
    noise = square / (total + 1e-300) * n / (n - SHAPE)
    return noise if noise > LEAST_NOISE else LEAST_NOISE


@inlined
def _leave_out_spoiled(pixels: CornerPixels, n: int, noise: float) -> int:
    """Number of pixels that are left: the one farthest from the model is taken out if no noise explains it.

    A pixel that is white or black whatever falls on it may lie, upon an edge, between its neighbours' values. Where its
    neighbours are as far off to the same side, it is no single pixel but the edge of what covers the board, or of a
    shadow; white and black ones side by side are none.
    """
    worst = 0
    for i in range(n):
        if abs(pixels.residual[i]) > abs(pixels.residual[worst]):
            worst = i
    square = pixels.residual[worst] ** 2
    if n <= LEAST_PIXELS or square <= SPOILED_NOISES * noise or square <= LEAST_SPOILED * LEAST_SPOILED:
        return n
    beside = 0
    for i in range(n):
        is_near = abs(pixels.x[i] - pixels.x[worst]) < 1.5 and abs(pixels.y[i] - pixels.y[worst]) < 1.5
        if is_near and 2.0 * pixels.residual[i] * pixels.residual[worst] > square:
            beside += 1
    if beside > MOST_TOGETHER:
        return n
    pixels.x[worst], pixels.y[worst], pixels.grey[worst] = pixels.x[n - 1], pixels.y[n - 1], pixels.grey[n - 1]
    return n - 1


@inlined
def _begin(start: Array, trial: Array, p: Array) -> bool:
    """Both shapes are `start`; True where it has no levels: then they are those of the saddle alone, on no mean."""
    for k in range(SHAPE):
        trial[k] = start[k]
    unlevelled = np.isnan(trial[MEAN])
    if unlevelled:
        trial[MEAN], trial[CONTRAST], trial[SLOPE], trial[SLOPE + 1] = 0.0, 1.0, 0.0, 0.0
    _copy(trial, p)
    return unlevelled


@inlined
def _move(p: Array, step: Array, right: Array, trial: Array) -> float:
    """The shape p after a step, within limits, in `trial`; the step's gain, its product with `right`."""
    gain = 0.0
    for k in range(SHAPE):
        gain += right[k] * step[k]
        trial[k] = p[k] + (_clipped(step[k], -FURTHEST_STEP[k], FURTHEST_STEP[k]) if k < MEAN else step[k])
    trial[BLUR] = _clipped(trial[BLUR], BLUR_LIMITS_PX[0], BLUR_LIMITS_PX[1])
    return gain


@inlined
def _hold_blur(p: Array, normal: Array, right: Array) -> None:
    """Take the blur out of the normal equations where it lies at a limit and would go beyond: the rest goes on."""
    if (p[BLUR] <= BLUR_LIMITS_PX[0] and right[BLUR] < 0.0) or (p[BLUR] >= BLUR_LIMITS_PX[1] and right[BLUR] > 0.0):
        right[BLUR] = 0.0
        for k in range(SHAPE):
            if k < BLUR:
                normal[BLUR, k] = 0.0
            elif k > BLUR:
                normal[k, BLUR] = 0.0


@inlined
def _invert(system: _System, covariance: Array) -> bool:
    """The corner's part (2, 2) of the inverse of the normal equations; False where they are not positive definite."""
    normal, lower, right, step, _ = system
    definite = True
    for k in range(2):
        for m in range(SHAPE):
            right[m] = 1.0 if m == k else 0.0
        definite = solve_damped(normal, right, 0.0, lower, step) and definite
        covariance[0, k], covariance[1, k] = step[0], step[1]
    return definite


@compiled
def _fit_all(
    image: NDArray[np.float32],
    task: CornerTask,
    steps: int,
    stop: float,
    fits: CornerFits,
    pixels: CornerPixels,
    system: _System,
) -> None:
    """Fill `fits`, whose fields hold NaN and False.

    The two loops stay together: with the inner one as a function of its own, inlined or not, the bits and the speed are
    the same, but the first compilation of this module takes 1.2 or 3 s more, to the 4 to 5 s that it takes.
    """
    starts, shapes, edges, sharp = task.starts, task.shapes, task.edges, task.sharp
    fitted, covariances, noises, converged = fits
    grey, residual, jacobian = pixels.grey, pixels.residual, pixels.jacobian
    normal, lower, right, step, trial = system
    for i in range(len(starts)):
        n = gather(image, task, i, pixels)
        if n < LEAST_PIXELS:
            continue
        p = fitted[i]
        cost, damping, noise, settled, least = -1.0, 1e-4, 0.0, False, n - MOST_SPOILED
        for count in range(-1 if _begin(shapes[i], trial, p) else 0, steps):
            draw(trial, n, edges[i], sharp[i], pixels)  # the one place: each copy takes seconds to compile
            if count < 0:
                start_levels(jacobian[CONTRAST], grey, n, trial)
                _copy(trial, p)
                continue
            new = _product(residual, residual, n)
            if cost < 0.0 or new <= cost:
                _copy(trial, p)
                settled = 0.0 <= cost - new <= stop * stop * noise
                cost, damping = new, 0.1 * damping
                _normal_equations(jacobian, residual, n, normal, right)
                _hold_blur(p, normal, right)
                noise = _noise(jacobian, residual, n)
            else:
                damping *= 10.0
            if not solve_damped(normal, right, damping, lower, step):
                break
            if settled or _move(p, step, right, trial) <= stop * stop * noise:
                _copy(trial, p)
                converged[i] = True  # also where the steps do not suffice for all spoiled pixels
                left = _leave_out_spoiled(pixels, n, noise) if n > least else n
                if left < n:
                    n, cost, damping, settled = left, -1.0, 1e-4, False
                    continue
                break
        converged[i] = _invert(system, covariances[i]) and converged[i]
        noises[i] = noise
        p[0] += starts[i, 0]
        p[1] += starts[i, 1]


def prepare() -> None:
    """Call the compiled function once."""
    nothing = CornerTask(
        starts=np.empty((0, 2)),
        shapes=np.empty((0, SHAPE)),
        edges=np.empty((0, 2, 3)),
        sharp=np.empty(0, bool),
        inverses=np.empty((0, 2, 2)),
        reaches=np.empty((0, 2)),
        clears=np.empty(0),
        windows=np.empty(0, np.int64),
        bands=np.empty(0),
        discs=np.empty((0, 2)),
        disc_axes=np.eye(2),
    )
    fit_corners(np.zeros((4, 4), np.float32), nothing, 1, 0.5)
