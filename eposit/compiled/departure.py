"""Whether the cost near its minimum is the parabola that a covariance states, and the covariance that it does state."""

from __future__ import annotations

import math

from eposit.compiled.kernel import NOTHING, NUMBER, NUMBERS, WHOLE, W, compiled, four, part
from eposit.compiled.layout import COSTS, HESSIAN, INFO, INFO_STEP, MINIMA, POINTS, SCRATCH, SEEN
from eposit.compiled.lens import radial_of_four

DEVIATIONS = 3.0  # standard deviations from the minimum at which the cost is compared with its parabola
WEAK = SCRATCH  # (2, 6) steps along the least known rotations
LEAST_RATIO = 0.25  # by which the covariance is widened at most; it counts as unreliable long before
DIAGONAL = math.sqrt(0.5)
THREE, SIX = (NUMBER,) * 3, (NUMBER,) * 6


@part(SIX, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER)
def _square(xx, xy, xz, yy, yz, zz):
    """The square of a symmetric matrix."""
    return (
        xx * xx + xy * xy + xz * xz, xx * xy + xy * yy + xz * yz, xx * xz + xy * yz + xz * zz,
        xy * xy + yy * yy + yz * yz, xy * xz + yy * yz + yz * zz, xz * xz + yz * yz + zz * zz,
    )  # fmt: skip


@part(THREE, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER)
def _power(xx, xy, xz, yy, yz, zz, x, y, z):
    """The fourth power of a symmetric matrix times (x, y, z)."""
    xx, xy, xz, yy, yz, zz = _square(xx, xy, xz, yy, yz, zz)
    xx, xy, xz, yy, yz, zz = _square(xx, xy, xz, yy, yz, zz)
    return xx * x + xy * y + xz * z, xy * x + yy * y + yz * z, xz * x + yz * y + zz * z


@part(NOTHING, W, WHOLE, NUMBER, NUMBER, NUMBER)
def _write_step(w, step, x, y, z):
    """At step (6) one standard deviation along the rotation (x, y, z) of any length."""
    C = HESSIAN
    for i in range(6):
        w[step + i] = w[C + 6 * i] * x + w[C + 6 * i + 1] * y + w[C + 6 * i + 2] * z
    over = 1.0 / math.sqrt(w[step] * x + w[step + 1] * y + w[step + 2] * z)
    for i in range(6):
        w[step + i] *= over


@compiled(NOTHING, W)
def weak_steps(w):
    """At WEAK (2, 6) steps of one standard deviation along the least known rotation, and along the least known of those
    that are independent of it. The inverse Hessian is at HESSIAN.

    Four steps of the power method on the covariance of the rotation, over its trace; any direction of large variance
    will do. The second direction is kept at right angles to the first step.
    """
    C = HESSIAN
    over = 1.0 / (w[C] + w[C + 7] + w[C + 14])
    xx, xy, xz, yy = over * w[C], over * w[C + 1], over * w[C + 2], over * w[C + 7]
    yz, zz = over * w[C + 8], over * w[C + 14]
    x, y, z = _power(xx, xy, xz, yy, yz, zz, 1.0, 1.0, 1.0)
    _write_step(w, WEAK, x, y, z)
    p, q, r = w[WEAK], w[WEAK + 1], w[WEAK + 2]
    over = 1.0 / math.sqrt(p * p + q * q + r * r)
    p, q, r = over * p, over * q, over * r
    a, b, c = xx * p + xy * q + xz * r, xy * p + yy * q + yz * r, xz * p + yz * q + zz * r
    half = 0.5 * (a * p + b * q + c * r)  # (1 - p p^T) M (1 - p p^T) = M - p a^T - a p^T with a = M p - half p
    a, b, c = a - half * p, b - half * q, c - half * r
    xx, xy, xz = xx - 2.0 * a * p, xy - a * q - b * p, xz - a * r - c * p
    yy, yz, zz = yy - 2.0 * b * q, yz - b * r - c * q, zz - 2.0 * c * r
    x, y, z = _power(xx, xy, xz, yy, yz, zz, q - r, r - p, p - q)
    _write_step(w, WEAK + 6, x, y, z)


@part(NUMBERS, W, WHOLE, NUMBERS, NUMBERS)
def _stepped(w, i, first, second):
    """Number i of four steps."""
    return first * w[WEAK + i] + second * w[WEAK + 6 + i]


@compiled(NUMBERS, W, WHOLE, NUMBERS, NUMBERS)
def costs_beside(w, n, first, second):
    """The costs of four poses side by side, each so many steps of WEAK from the minimum; infinite without an image.

    Rotations are Cayley's, as in `descent.moved`.
    """
    x, y, z = (
        0.5 * _stepped(w, 0, first, second),
        0.5 * _stepped(w, 1, first, second),
        0.5 * _stepped(w, 2, first, second),
    )
    gain = 2.0 / (1.0 + x * x + y * y + z * z)
    gx, gy, gz = gain * x, gain * y, gain * z
    r0, r1, r2 = 1.0 - gy * y - gz * z, gx * y - gz, gx * z + gy
    r3, r4, r5 = gx * y + gz, 1.0 - gx * x - gz * z, gy * z - gx
    r6, r7, r8 = gx * z - gy, gy * z + gx, 1.0 - gx * x - gy * y
    t0 = w[MINIMA + 9] + _stepped(w, 3, first, second)
    t1 = w[MINIMA + 10] + _stepped(w, 4, first, second)
    t2 = w[MINIMA + 11] + _stepped(w, 5, first, second)
    o, e, j = POINTS, POINTS + SEEN * n, POINTS + INFO * n
    step, costs = int(w[INFO_STEP]), four(0.0, 0.0, 0.0, 0.0)
    for _ in range(n):
        o0, o1, o2 = w[o], w[o + 1], w[o + 2]
        a0 = w[MINIMA] * o0 + w[MINIMA + 1] * o1 + w[MINIMA + 2] * o2
        a1 = w[MINIMA + 3] * o0 + w[MINIMA + 4] * o1 + w[MINIMA + 5] * o2
        a2 = w[MINIMA + 6] * o0 + w[MINIMA + 7] * o1 + w[MINIMA + 8] * o2
        x, y = r0 * a0 + r1 * a1 + r2 * a2 + t0, r3 * a0 + r4 * a1 + r5 * a2 + t1
        s = radial_of_four(w, x * x + y * y, r6 * a0 + r7 * a1 + r8 * a2 + t2)[0]
        u, v = s * x - w[e], s * y - w[e + 1]
        costs += w[j] * u * u + 2.0 * w[j + 1] * u * v + w[j + 2] * v * v
        o += 3
        e += 2
        j += step
    return costs if costs < math.inf else math.inf


@compiled(NUMBER, W, WHOLE, NUMBER)
def departure(w, n, variance):
    """How far the cost is from its parabola along the two least known rotations: the largest |log| of their ratio in
    eight directions.

    The inverse Hessian is at HESSIAN; it grows along each of the two so that it states no more than the cost does.
    variance: of residuals of unit weight.
    """
    weak_steps(w)
    expected = DEVIATIONS * DEVIATIONS * variance
    root, over = math.sqrt(expected), 1.0 / expected
    along = over * (costs_beside(w, n, root * four(1.0, -1.0, 0.0, 0.0), root * four(0.0, 0.0, 1.0, -1.0)) - w[COSTS])
    side = root * DIAGONAL
    between = costs_beside(w, n, side * four(1.0, -1.0, 1.0, -1.0), side * four(1.0, 1.0, -1.0, -1.0))
    between = over * (between - w[COSTS])
    for k in range(2):
        ratio = min(1.0, min(along[2 * k], along[2 * k + 1]))
        grow = 1.0 / max(ratio, LEAST_RATIO) - 1.0
        for i in range(6):
            part = grow * w[WEAK + 6 * k + i]
            for j in range(6):
                w[HESSIAN + 6 * i + j] += part * w[WEAK + 6 * k + j]
    least, most = min(along, between), max(along, between)
    smallest = min(min(least[0], least[1]), min(least[2], least[3]))
    largest = max(max(most[0], most[1]), max(most[2], most[3]))
    return math.log(max(largest, 1.0 / smallest)) if smallest > 0.0 else math.inf
