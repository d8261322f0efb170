"""Compiled least squares of a chessboard corner: two crossing edges, blurred, under a light that has a slope.

grey = (m + c S) (1 + g . x), where S is the blurred product of the signs of the two sides. With signed distances d1
and d2 to the edges, a = d / sigma, and r the cosine between the edges' normals, S is the mean of sign(a1 + z1)
sign(a2 + z2) over two standard normals of correlation r, which to the third order in r is

    erf(a1 / sqrt 2) erf(a2 / sqrt 2) + r b1 b2 (1 + r a1 a2 / 2 + r^2 (a1^2 - 1) (a2^2 - 1) / 6),
    b = sqrt(2 / pi) exp(-a^2 / 2).

The edges are parabolas whose curvature is given: a lens bends lines, and a straight model would be pulled towards the
hollow side. The slope of the light shifts the blurred pattern by sigma^2 g.

Source:
    The series is Mehler's expansion of the bivariate normal distribution.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.erf import GAUSS, REORDER, decay, signed_share

# Numbers of a shape, in order: corner x, y, px from the start; directions of the two normals, rad; blur sigma, px;
# mean grey m, contrast c; slope of the light g, 1/px.
SHAPE = 9
BLUR, MEAN, CONTRAST, SLOPE = 4, 5, 6, 7
BLUR_LIMITS_PX = (0.2, 6.0)
FURTHEST_STEP = np.array([0.7, 0.7, 0.15, 0.15, 0.4, 1e9, 1e9, 1e9, 1e9])  # in one iteration
LEAST_PIXELS = 24


@njit(cache=True, fastmath=REORDER, error_model="numpy")
def _model(
    p: Array, x: Array, y: Array, grey: Array, n: int, bend1: float, bend2: float, jacobian: Array, residual: Array
) -> None:
    """(9, n) change of the modelled grey for a change of the shape, and (n,) grey minus model."""
    c1, s1, c2, s2 = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    x0, y0, sigma, mean, contrast, gx, gy = p[0], p[1], p[4], p[5], p[6], p[7], p[8]
    r, per_sigma, variance = c1 * c2 + s1 * s2, 1.0 / sigma, sigma * sigma
    for i in range(n):
        u, v = x[i] - x0, y[i] - y0
        us, vs = u + variance * gx, v + variance * gy
        t1, t2 = c1 * vs - s1 * us, c2 * vs - s2 * us
        a1 = (c1 * us + s1 * vs - 0.5 * bend1 * (t1 * t1 + variance)) * per_sigma
        a2 = (c2 * us + s2 * vs - 0.5 * bend2 * (t2 * t2 + variance)) * per_sigma
        bell1, bell2 = decay(0.5 * a1 * a1), decay(0.5 * a2 * a2)
        e1, e2 = signed_share(a1, bell1), signed_share(a2, bell2)
        b1, b2 = GAUSS * bell1, GAUSS * bell2
        both = r * b1 * b2
        saddle = e1 * e2 + both * (1.0 + 0.5 * r * a1 * a2 + r * r / 6.0 * (a1 * a1 - 1.0) * (a2 * a2 - 1.0))
        light, level = 1.0 + gx * u + gy * v, mean + contrast * saddle
        lit = contrast * light * per_sigma
        d1, d2 = lit * (b1 * e2 - both * a1), lit * (b2 * e1 - both * a2)  # for a change of the distances
        jacobian[0, i] = -d1 * (c1 + bend1 * t1 * s1) - d2 * (c2 + bend2 * t2 * s2) - level * gx
        jacobian[1, i] = -d1 * (s1 - bend1 * t1 * c1) - d2 * (s2 - bend2 * t2 * c2) - level * gy
        jacobian[2, i] = d1 * t1
        jacobian[3, i] = d2 * t2
        jacobian[4, i] = -d1 * a1 - d2 * a2
        jacobian[5, i] = light
        jacobian[6, i] = saddle * light
        jacobian[7, i] = level * u
        jacobian[8, i] = level * v
        residual[i] = grey[i] - level * light


@njit(cache=True)
def _solve(normal: Array, right: Array, damping: float, out: Array) -> bool:
    """Cholesky solution of (N + damping diag N) x = b; False where N is not positive definite."""
    n = len(right)
    lower = np.zeros((n, n))
    for i in range(n):
        for j in range(i + 1):
            rest = normal[i, j]
            if i == j:
                rest += damping * normal[i, i] + 1e-12
            for k in range(j):
                rest -= lower[i, k] * lower[j, k]
            if i != j:
                lower[i, j] = rest / lower[j, j]
            elif rest > 0.0:
                lower[i, i] = math.sqrt(rest)
            else:
                return False
    for i in range(n):
        rest = right[i]
        for k in range(i):
            rest -= lower[i, k] * out[k]
        out[i] = rest / lower[i, i]
    for i in range(n - 1, -1, -1):
        rest = out[i]
        for k in range(i + 1, n):
            rest -= lower[k, i] * out[k]
        out[i] = rest / lower[i, i]
    return True


@njit(cache=True)
def _gather(
    image: NDArray[np.uint8],
    start: Array,
    inverse: Array,
    reach: Array,
    window: int,
    discs: Array,
    disc_axes: Array,
    x: Array,
    y: Array,
    grey: Array,
) -> int:
    """Pixels of one corner: within `window` px, `reach` squares along both axes, and off the discs."""
    n, left, top = 0, round(start[0]), round(start[1])
    for row in range(max(top - window, 0), min(top + window + 1, image.shape[0])):
        for column in range(max(left - window, 0), min(left + window + 1, image.shape[1])):
            u, v = column - start[0], row - start[1]
            across, down = inverse[0, 0] * u + inverse[0, 1] * v, inverse[1, 0] * u + inverse[1, 1] * v
            if abs(across) > reach[0] or abs(down) > reach[1] or u * u + v * v > window * window:
                continue
            covered = False
            for k in range(len(discs)):
                du, dv = column - discs[k, 0], row - discs[k, 1]
                p = disc_axes[0, 0] * du + disc_axes[0, 1] * dv
                q = disc_axes[1, 0] * du + disc_axes[1, 1] * dv
                covered = covered or p * p + q * q < 1.0
            if not covered:
                x[n], y[n], grey[n] = u, v, image[row, column]
                n += 1
    return n


@njit(cache=True)
def _levels(p: Array, jacobian: Array, grey: Array, n: int) -> None:
    """Mean and contrast by linear regression on the saddle, which `_model` left in the jacobian's row 6."""
    saddle = jacobian[6, :n]
    middle, level = saddle.mean(), grey[:n].mean()
    p[6] = np.sum((saddle - middle) * (grey[:n] - level)) / max(np.sum((saddle - middle) ** 2), 1e-12)
    p[5] = level - p[6] * middle


@njit(cache=True)
def fit_corners(
    image: NDArray[np.uint8],
    starts: Array,
    shapes: Array,
    bends: Array,
    inverses: Array,
    reaches: Array,
    window: int,
    discs: Array,
    disc_axes: Array,
    steps: int,
    stop: float,
) -> tuple[Array, Array, Array, Mask]:
    """Fit every corner by Levenberg-Marquardt.

    image: (height, width) 8 bits. starts: (n, 2) px. shapes: (n, 9) where to start from; without a mean grey (NaN),
    mean and contrast are worked out. bends: (n, 2) curvatures of the edges towards their normals, 1/px. inverses:
    (n, 2, 2) squares per px. reaches: (n, 2) squares that a fit may use along both axes. window: px, likewise.
    discs: (k, 2) centres, px, of ellipses to leave out, with disc_axes (2, 2) from px to the unit circle. stop: step,
    in standard deviations of what is fitted, at which it has converged.

    Returns:
        (n, 9) shapes with the corner in px of the image, (n, 2, 2) covariances, px^2, for noise of one grey level, (n,)
        variance of the noise that the pixels on the edges show, (n,) whether it converged. NaN where too few pixels
        are there.
    """
    count, most = len(starts), (2 * window + 1) ** 2
    out, covariances = np.full((count, SHAPE), np.nan), np.full((count, 2, 2), np.nan)
    noises, converged = np.full(count, np.nan), np.zeros(count, np.bool_)
    x, y, grey, residual = np.empty(most), np.empty(most), np.empty(most), np.empty(most)
    jacobian, step, unit = np.empty((SHAPE, most)), np.empty(SHAPE), np.empty(SHAPE)
    for i in range(count):
        n = _gather(image, starts[i], inverses[i], reaches[i], window, discs, disc_axes, x, y, grey)
        if n < LEAST_PIXELS:
            continue
        p, trial = out[i], shapes[i].copy()
        p[:] = trial
        if np.isnan(p[5]):
            trial[5:] = np.array([0.0, 1.0, 0.0, 0.0])
            _model(trial, x, y, grey, n, bends[i, 0], bends[i, 1], jacobian, residual)
            _levels(trial, jacobian, grey, n)
            p[:] = trial
        rows, left = jacobian[:, :n], residual[:n]
        normal, right = np.zeros((SHAPE, SHAPE)), np.zeros(SHAPE)
        cost, damping, noise = -1.0, 1e-4, 0.0
        for _ in range(steps):
            _model(trial, x, y, grey, n, bends[i, 0], bends[i, 1], jacobian, residual)
            new = np.dot(left, left)
            if cost < 0.0 or new <= cost:
                p[:] = trial
                cost, damping = new, 0.1 * damping
                whole = np.ascontiguousarray(rows)
                normal, right = np.dot(whole, whole.T), np.dot(whole, left)
                told = rows[0] ** 2 + rows[1] ** 2  # what a pixel tells of the position
                noise = np.sum(told * left**2) / max(np.sum(told), 1e-300) * n / (n - SHAPE)
            else:
                damping *= 10.0
            if not _solve(normal, right, damping, step):
                break
            small = np.dot(right, step) <= stop * stop * noise
            for k in range(SHAPE):
                trial[k] = p[k] + min(max(step[k], -FURTHEST_STEP[k]), FURTHEST_STEP[k])
            trial[BLUR] = min(max(trial[BLUR], BLUR_LIMITS_PX[0]), BLUR_LIMITS_PX[1])
            if small:
                p[:] = trial
                converged[i] = True
                break
        for k in range(2):
            unit[:] = 0.0
            unit[k] = 1.0
            if not _solve(normal, unit, 0.0, step):
                converged[i] = False
            covariances[i, 0, k], covariances[i, 1, k] = step[0], step[1]
        noises[i] = noise
        p[0] += starts[i, 0]
        p[1] += starts[i, 1]
    return out, covariances, noises, converged
