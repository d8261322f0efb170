"""POSIT's iteration for one image: scaled orthography, whose fixed point is a pose.

The unknown is k, the third axis of the camera in the object's frame over the depth of the object's first point; I and
J, the first two axes over the depth, are rest + pull k. Lengths are over the object's reach, the largest distance
from the first point.

Source:
    Paper, equations 21 to 25; DeMenthon and Davis 1995: A I = (1 + A k) x - x_0, so that the unknowns are in k alone.
"""

from __future__ import annotations

import math

from eposit.compiled.kernel import NOTHING, NUMBER, WHOLE, W, compiled
from eposit.compiled.layout import IMAGE, OFFSETS, POINTS, REACH, SCRATCH, SOLVER

CONTRACTS = (
    0.5  # largest contraction with which Newton steps are used: far from 1, as noise keeps I, J from right angles
)
NEWTON_STEPS = 12
REST, PULL, AXES, K, TARGET = SCRATCH, SCRATCH + 6, SCRATCH + 24, SCRATCH + 30, SCRATCH + 33
BEFORE, GAIN = SCRATCH + 36, SCRATCH + 42


@compiled(NOTHING, W, WHOLE)
def pseudo_inverse(w, n):
    """At SOLVER (3, n) that of the n - 1 offsets, of full rank, by orthogonal columns, each made so twice."""
    A, out, U = POINTS + OFFSETS * n, POINTS + SOLVER * n, SCRATCH
    for i in range(9):
        w[U + i] = 0.0
    for c in range(3):
        q = out + n * c
        for i in range(n - 1):
            w[q + i] = w[A + 3 * i + c]
        for _ in range(2):
            for before in range(c):
                p, part = out + n * before, 0.0
                for i in range(n - 1):
                    part += w[p + i] * w[q + i]
                for i in range(n - 1):
                    w[q + i] -= part * w[p + i]
                w[U + 3 * before + c] += part
        size = 0.0
        for i in range(n - 1):
            size += w[q + i] * w[q + i]
        w[U + 4 * c] = math.sqrt(size)
        for i in range(n - 1):
            w[q + i] /= w[U + 4 * c]
    for i in range(n - 1):
        z = w[out + 2 * n + i] / w[U + 8]
        y = (w[out + n + i] - w[U + 5] * z) / w[U + 4]
        w[out + i] = (w[out + i] - w[U + 1] * y - w[U + 2] * z) / w[U]
        w[out + n + i], w[out + 2 * n + i] = y, z


@compiled(NUMBER, W, WHOLE)
def orthography(w, n):
    """From IMAGE: REST (2, 3) and PULL (2, 3, 3); the contraction: k -> F(k) shortens distances to so much or less.

    It is the Frobenius norm of pull. With i, j, u of unit length along I, J, k and M the pull of each, the slope of F
    is u (i M_x + j M_y) / 2 - i (u M_x) - j (u M_y) for I and J of equal length at right angles. Its terms have ranges
    at right angles, and each takes rows of M that no other takes: its norm is below that of M.
    """
    for i in range(24):
        w[REST + i] = 0.0
    image = POINTS + IMAGE * n
    x0, y0 = w[image], w[image + 1]
    for j in range(n - 1):
        x, y = w[image + 2 * j + 2], w[image + 2 * j + 3]
        offset = POINTS + OFFSETS * n + 3 * j
        for i in range(3):
            s = w[POINTS + SOLVER * n + n * i + j]
            w[REST + i] += s * (x - x0)
            w[REST + 3 + i] += s * (y - y0)
            for k in range(3):
                o = s * w[offset + k]
                w[PULL + 3 * i + k] += o * x
                w[PULL + 9 + 3 * i + k] += o * y
    total = 0.0
    for i in range(18):
        total += w[PULL + i] * w[PULL + i]
    return math.sqrt(total)


@compiled(NUMBER, W)
def _follow(w):
    """At AXES I and J at K; their mean length, and at TARGET F(k): at right angles to both and of this length."""
    for i in range(6):
        p = PULL + 3 * i
        w[AXES + i] = w[REST + i] + w[p] * w[K] + w[p + 1] * w[K + 1] + w[p + 2] * w[K + 2]
    i0, i1, i2 = w[AXES], w[AXES + 1], w[AXES + 2]
    j0, j1, j2 = w[AXES + 3], w[AXES + 4], w[AXES + 5]
    scale = 0.5 * (math.sqrt(i0 * i0 + i1 * i1 + i2 * i2) + math.sqrt(j0 * j0 + j1 * j1 + j2 * j2))
    k0, k1, k2 = i1 * j2 - i2 * j1, i2 * j0 - i0 * j2, i0 * j1 - i1 * j0
    over = scale / math.sqrt(k0 * k0 + k1 * k1 + k2 * k2)
    w[TARGET], w[TARGET + 1], w[TARGET + 2] = k0 * over, k1 * over, k2 * over
    return scale


@compiled(NOTHING, W, NUMBER)
def _slope_inverse(w, scale):
    """At GAIN (9) the inverse of 1 minus the slope of F, as `orthography` gives it."""
    over = 1.0 / (scale * scale)
    for c in range(3):
        x = y = along = 0.0
        for i in range(3):
            p, q = w[PULL + 3 * i + c], w[PULL + 9 + 3 * i + c]
            along += 0.5 * over * (w[AXES + i] * p + w[AXES + 3 + i] * q)
            x += over * w[TARGET + i] * p
            y += over * w[TARGET + i] * q
        for i in range(3):
            w[GAIN + 3 * i + c] = (
                w[AXES + i] * x + w[AXES + 3 + i] * y - w[TARGET + i] * along + (1.0 if i == c else 0.0)
            )
    m0, m1, m2 = w[GAIN], w[GAIN + 1], w[GAIN + 2]
    m3, m4, m5 = w[GAIN + 3], w[GAIN + 4], w[GAIN + 5]
    m6, m7, m8 = w[GAIN + 6], w[GAIN + 7], w[GAIN + 8]
    c0, c1, c2 = m4 * m8 - m5 * m7, m5 * m6 - m3 * m8, m3 * m7 - m4 * m6
    f = 1.0 / (m0 * c0 + m1 * c1 + m2 * c2)
    w[GAIN], w[GAIN + 3], w[GAIN + 6] = c0 * f, c1 * f, c2 * f
    w[GAIN + 1], w[GAIN + 4], w[GAIN + 7] = (m2 * m7 - m1 * m8) * f, (m0 * m8 - m2 * m6) * f, (m1 * m6 - m0 * m7) * f
    w[GAIN + 2], w[GAIN + 5], w[GAIN + 8] = (m1 * m5 - m2 * m4) * f, (m2 * m3 - m0 * m5) * f, (m0 * m4 - m1 * m3) * f


@compiled(WHOLE, W, NUMBER, NUMBER)
def _newton(w, contraction, tol):
    """Steps of (1 - slope)^-1 (F(k) - k) with the slope at the second; their number, negative if they do not settle."""
    w[K] = w[K + 1] = w[K + 2] = 0.0
    last = 0.0
    limit = (tol / contraction) * (tol / contraction)  # I and J change by so much of the change of k at most
    for count in range(1, NEWTON_STEPS + 1):
        scale, change = _follow(w), 0.0
        if count == 2:
            _slope_inverse(w, scale)
        x, y, z = w[TARGET] - w[K], w[TARGET + 1] - w[K + 1], w[TARGET + 2] - w[K + 2]
        for i in range(3):
            g = GAIN + 3 * i
            step = w[TARGET + i] - w[K + i] if count == 1 else w[g] * x + w[g + 1] * y + w[g + 2] * z
            w[K + i] += step
            change += step * step
        change /= scale * scale
        if count > 1 and (change <= limit or (count > 2 and change * change <= limit * last)):
            _follow(w)
            return count
        last = change
    return -NEWTON_STEPS


@compiled(WHOLE, W, NUMBER, NUMBER, WHOLE, NUMBER, NUMBER)
def fixed_point(w, contraction, tol, max_iterations, start, fraction):
    """At AXES I and J where they have settled; the number of iterations, negative where they have not.

    tol: they have when they change by less than this, relative to their length, or would in the next step if that
    shortens the change as the last one did. start: 1.0 to begin at K, 0.0 at zero. fraction: of each update that is
    taken. Where the iteration surely contracts, Newton steps find its one fixed point in fewer steps.
    """
    if start == 0.0:
        if contraction <= CONTRACTS:
            count = _newton(w, contraction, tol)
            if 0 < count <= max_iterations:
                return count
        w[K] = w[K + 1] = w[K + 2] = 0.0
    last = 0.0
    for count in range(1, max_iterations + 1):
        scale, change = _follow(w), 0.0
        for i in range(6):
            step = w[AXES + i] - w[BEFORE + i]
            change += step * step
            w[BEFORE + i] = w[AXES + i]
        for i in range(3):
            w[K + i] = fraction * w[TARGET + i] + (1.0 - fraction) * w[K + i]
        if count > 1:
            limit = (tol * scale) * (tol * scale)
            if change <= limit or change * change <= limit * last:
                return count
            last = change
        if not scale < math.inf:
            return -count
    return -max_iterations


@compiled(NOTHING, W, WHOLE, WHOLE)
def write_fixed_point(w, n, pose):
    """At pose that of I and J: the defect of their right angle is shared between them."""
    size = 0.0
    for i in range(2):
        axis = AXES + 3 * i
        long = math.sqrt(w[axis] * w[axis] + w[axis + 1] * w[axis + 1] + w[axis + 2] * w[axis + 2])
        size += long
        for k in range(3):
            w[BEFORE + 3 * i + k] = w[axis + k] / long
    p = q = 0.0
    for k in range(3):
        a, b = w[BEFORE + k], w[BEFORE + 3 + k]
        p += (a + b) * (a + b)
        q += (a - b) * (a - b)
    p, q = math.sqrt(0.5 / p), math.sqrt(0.5 / q)
    for k in range(3):
        a, b = w[BEFORE + k], w[BEFORE + 3 + k]
        w[pose + k] = p * (a + b) + q * (a - b)
        w[pose + 3 + k] = p * (a + b) - q * (a - b)
    a, b, c = w[pose], w[pose + 1], w[pose + 2]
    x, y, z = w[pose + 3], w[pose + 4], w[pose + 5]
    w[pose + 6], w[pose + 7], w[pose + 8] = b * z - c * y, c * x - a * z, a * y - b * x
    depth, image = 2.0 * w[REACH] / size, POINTS + IMAGE * n
    for i in range(3):
        r = pose + 3 * i
        seen = 1.0 if i == 2 else w[image + i]
        first = w[r] * w[POINTS] + w[r + 1] * w[POINTS + 1] + w[r + 2] * w[POINTS + 2]
        w[pose + 9 + i] = depth * seen - first
