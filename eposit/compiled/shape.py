"""What an object's points allow: their spreads, their plane, and how many are distinct."""

from __future__ import annotations

import math

from eposit.compiled.kernel import NOTHING, NUMBER, WHOLE, W, compiled, part
from eposit.compiled.layout import (
    CENTRE,
    FLAT,
    FLATNESS,
    OFFSETS,
    PLANE,
    POINTS,
    REACH,
    SCRATCH,
    SIZE,
    SOLID,
    THICKNESS,
)  # fmt: skip
from eposit.compiled.orthography import pseudo_inverse
from eposit.compiled.p3p import widest_triangle

DESCRIBED, TOO_FEW_POINTS, ON_A_LINE = 0, 1, 2
SWEEPS = 12
SAME_POINT = 1e-9  # of the object's size: points nearer to each other are one
COPLANAR_CONDITION = 1e4  # ratio of spreads from which points count as in one plane, or on one line
S, V = SCRATCH, SCRATCH + 9  # of `spreads`


@part(NOTHING, W, WHOLE, WHOLE, NUMBER, NUMBER)
def _turn(w, a, b, c, s):
    w[a], w[b] = c * w[a] - s * w[b], s * w[a] + c * w[b]


@compiled(NOTHING, W, WHOLE, WHOLE, WHOLE)
def spreads(w, points, count, out):
    """At out (9) the axes of most and least spread about zero, rows of a rotation, and at S their squared spreads.

    Jacobi's rotations of the (3, 3) matrix of the sums of products.
    """
    for i in range(9):
        w[S + i] = 0.0
        w[out + i] = 1.0 if i % 4 == 0 else 0.0
    for i in range(count):
        o = points + 3 * i
        for p in range(3):
            for q in range(3):
                w[S + 3 * p + q] += w[o + p] * w[o + q]
    for _ in range(SWEEPS):
        for p in range(2):
            for q in range(p + 1, 3):
                off = w[S + 3 * p + q]
                if off == 0.0:
                    continue
                tau = 0.5 * (w[S + 4 * q] - w[S + 4 * p]) / off
                t = math.copysign(1.0, tau) / (abs(tau) + math.sqrt(1.0 + tau * tau))
                c = 1.0 / math.sqrt(1.0 + t * t)
                s = t * c
                for k in range(3):
                    _turn(w, S + 3 * k + p, S + 3 * k + q, c, s)
                for k in range(3):
                    _turn(w, S + 3 * p + k, S + 3 * q + k, c, s)
                    _turn(w, out + 3 * p + k, out + 3 * q + k, c, s)
    w[S], w[S + 1], w[S + 2] = max(w[S], 0.0), max(w[S + 4], 0.0), max(w[S + 8], 0.0)  # rounding may leave less
    for i in range(2):
        for j in range(2, i, -1):
            if w[S + j] > w[S + j - 1]:
                w[S + j], w[S + j - 1] = w[S + j - 1], w[S + j]
                for k in range(3):
                    a, b = out + 3 * j + k, out + 3 * j - 3 + k
                    w[a], w[b] = w[b], w[a]
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        w[out + 6 + k] = w[out + i] * w[out + 3 + j] - w[out + j] * w[out + 3 + i]


@compiled(WHOLE, W, WHOLE)
def distinct(w, n):
    """How many of the points differ, counted up to four."""
    count = 0
    for i in range(n):
        new = True
        for j in range(count):
            far = 0.0
            for axis in range(3):
                gap = w[POINTS + 3 * i + axis] - w[SCRATCH + 3 * j + axis]
                far += gap * gap
            if far <= SAME_POINT * SAME_POINT:
                new = False
        if new:
            for axis in range(3):
                w[SCRATCH + 3 * count + axis] = w[POINTS + 3 * i + axis]
            count += 1
            if count == 4:
                break
    return count


@compiled(NOTHING, W, WHOLE)
def _offsets(w, n):
    """The offsets from the first point over the largest, whether they are solid, and then their pseudo-inverse."""
    reach, A = 0.0, POINTS + OFFSETS * n
    for i in range(n - 1):
        far = 0.0
        for axis in range(3):
            gap = w[POINTS + 3 * i + 3 + axis] - w[POINTS + axis]
            w[A + 3 * i + axis] = gap
            far += gap * gap
        reach = max(reach, far)
    reach = math.sqrt(reach)
    for i in range(3 * n - 3):
        w[A + i] /= reach
    spreads(w, A, n - 1, V)
    first, third = math.sqrt(w[S]), math.sqrt(w[S + 2])
    w[REACH], w[THICKNESS], w[SOLID] = reach, reach * third, 0.0
    if first <= COPLANAR_CONDITION * third and third > 0.0:
        w[SOLID] = 1.0
        pseudo_inverse(w, n)


@compiled(WHOLE, W, WHOLE)
def describe(w, n):
    """Bring the points to their centroid and size, and write all that starts need; whether the object has a pose."""
    size = w[SOLID] = 0.0
    for axis in range(3):
        first, total = w[POINTS + axis], 0.0
        for i in range(n):
            total += w[POINTS + 3 * i + axis] - first
        w[CENTRE + axis] = first + total / n
        for i in range(n):
            w[POINTS + 3 * i + axis] -= w[CENTRE + axis]
            size = max(size, abs(w[POINTS + 3 * i + axis]))
    if size > 0.0:
        for i in range(3 * n):
            w[POINTS + i] /= size
    w[SIZE] = size
    if size == 0.0 or distinct(w, n) < 4:
        return TOO_FEW_POINTS
    spreads(w, POINTS, n, PLANE)
    first, second, third = math.sqrt(w[S]), math.sqrt(w[S + 1]), math.sqrt(w[S + 2])
    if second <= first / COPLANAR_CONDITION:
        return ON_A_LINE
    w[FLATNESS] = third / second
    for i in range(n):
        for axis in range(2):
            part = 0.0
            for k in range(3):
                part += w[POINTS + 3 * i + k] * w[PLANE + 3 * axis + k]
            w[POINTS + FLAT * n + 2 * i + axis] = part
    widest_triangle(w, n)
    _offsets(w, n)
    return DESCRIBED
