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
from pipelines.detection.kernels import compiled, inlined

BLUR_LIMITS_PX = (0.2, 6.0)
FURTHEST_STEP = (0.7, 0.7, 0.15, 0.15, 0.4)  # of the first numbers in one iteration; the others are linear
LEAST_PIXELS = 24


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


def fit_corners(image: NDArray[np.uint8], task: CornerTask, steps: int, stop: float) -> CornerFits:
    """Fit every corner by Levenberg and Marquardt.

    image: (height, width) 8 bits. stop: step, in standard deviations of what is fitted, at which it has converged.
    """
    count, most = len(task.starts), (2 * task.window + 1) ** 2
    fits = CornerFits(
        np.full((count, SHAPE), np.nan), np.full((count, 2, 2), np.nan), np.full(count, np.nan), np.zeros(count, bool)
    )
    pixels = CornerPixels(np.empty(most), np.empty(most), np.empty(most), np.empty(most), np.empty((SHAPE, most)))
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


@inlined
def _normal_equations(jacobian: Array, residual: Array, n: int, normal: Array, right: Array) -> None:
    """Lower triangle of J J^T in `normal` and J r in `right`."""
    for a in range(SHAPE):
        total = 0.0
        for i in range(n):
            total += jacobian[a, i] * residual[i]
        right[a] = total
        for b in range(a + 1):
            total = 0.0
            for i in range(n):
                total += jacobian[a, i] * jacobian[b, i]
            normal[a, b] = total


@inlined
def _noise(jacobian: Array, residual: Array, n: int) -> float:
    """Variance of the residuals, each weighed by what its pixel says of the position."""
    square, total = 0.0, 0.0
    for i in range(n):
        weight = jacobian[0, i] ** 2 + jacobian[1, i] ** 2
        square += weight * residual[i] ** 2
        total += weight
    return square / (total + 1e-300) * n / (n - SHAPE)


@inlined
def _sum_of_squares(values: Array, n: int) -> float:
    total = 0.0
    for i in range(n):
        total += values[i] * values[i]
    return total


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
    image: NDArray[np.uint8],
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
    starts, shapes, bends = task.starts, task.shapes, task.bends
    fitted, covariances, noises, converged = fits
    _, _, grey, residual, jacobian = pixels
    normal, lower, right, step, trial = system
    for i in range(len(starts)):
        n = gather(image, task, i, pixels)
        if n < LEAST_PIXELS:
            continue
        p = fitted[i]
        cost, damping, noise = -1.0, 1e-4, 0.0
        for count in range(-1 if _begin(shapes[i], trial, p) else 0, steps):
            draw(trial, n, bends[i, 0], bends[i, 1], pixels)  # the one place: each copy takes seconds to compile
            if count < 0:
                start_levels(jacobian[CONTRAST], grey, n, trial)
                _copy(trial, p)
                continue
            new = _sum_of_squares(residual, n)
            if cost < 0.0 or new <= cost:
                _copy(trial, p)
                cost, damping = new, 0.1 * damping
                _normal_equations(jacobian, residual, n, normal, right)
                noise = _noise(jacobian, residual, n)
            else:
                damping *= 10.0
            if not solve_damped(normal, right, damping, lower, step):
                break
            if _move(p, step, right, trial) <= stop * stop * noise:
                _copy(trial, p)
                converged[i] = True
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
        bends=np.empty((0, 2)),
        inverses=np.empty((0, 2, 2)),
        reaches=np.empty((0, 2)),
        clears=np.empty(0),
        window=1,
        discs=np.empty((0, 2)),
        disc_axes=np.eye(2),
    )
    fit_corners(np.zeros((4, 4), np.uint8), nothing, 1, 0.5)
