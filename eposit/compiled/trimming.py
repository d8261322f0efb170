"""Residuals of a pose, the points that are nearest to it, and a fit to some of the points."""

from __future__ import annotations

import math

from eposit.compiled.descent import copy, moved
from eposit.compiled.kernel import NOTHING, NUMBER, WHOLE, W, compiled
from eposit.compiled.layout import (
    GRADIENT,
    HESSIAN,
    HESSIAN_NEW,
    INFO,
    MOVE,
    POINTS,
    PROPOSAL,
    RESIDUALS,
    SCRATCH,
    SEEN,
    SORTED,
    WEIGHTS,
)
from eposit.compiled.lens import radial
from eposit.compiled.linear6 import factorise, inverse, solve
from eposit.compiled.model import derivatives

FIT_STEPS = 2
FACTOR_PLACE = SCRATCH + 80


@compiled(NOTHING, W, WHOLE, WHOLE)
def residuals(w, n, pose):
    """At RESIDUALS the squares, over the variances; infinite where a point is missing or has no image."""
    for i in range(n):
        o, e, j = POINTS + 3 * i, POINTS + SEEN * n + 2 * i, POINTS + WEIGHTS * n + 3 * i
        a, b, c = w[o], w[o + 1], w[o + 2]
        x = w[pose] * a + w[pose + 1] * b + w[pose + 2] * c + w[pose + 9]
        y = w[pose + 3] * a + w[pose + 4] * b + w[pose + 5] * c + w[pose + 10]
        z = w[pose + 6] * a + w[pose + 7] * b + w[pose + 8] * c + w[pose + 11]
        s = radial(w, x * x + y * y, z)[0]
        u, v = s * x - w[e], s * y - w[e + 1]
        square = w[j] * u * u + 2.0 * w[j + 1] * u * v + w[j + 2] * v * v
        w[POINTS + RESIDUALS * n + i] = square if square < math.inf else math.inf


@compiled(NUMBER, W, WHOLE, WHOLE)
def smallest(w, n, count):
    """The sum of the `count` smallest numbers at RESIDUALS, which come first at SORTED, the largest of them last."""
    first = POINTS + SORTED * n
    copy(w, POINTS + RESIDUALS * n, first, n)
    low, high, target = 0, n - 1, count - 1
    while low < high:  # Hoare's selection
        pivot, i, j = w[first + (low + high) // 2], low, high
        while i <= j:
            while w[first + i] < pivot:
                i += 1
            while w[first + j] > pivot:
                j -= 1
            if i <= j:
                w[first + i], w[first + j] = w[first + j], w[first + i]
                i += 1
                j -= 1
        if target <= j:
            high = j
        elif target >= i:
            low = i
        else:
            break
    total = 0.0
    for i in range(count):
        total += w[first + i]
    return total


@compiled(NOTHING, W, WHOLE, WHOLE)
def choose(w, n, count):
    """Give the `count` points of smallest RESIDUALS their weights and the others none; earlier ones first if equal."""
    smallest(w, n, count)
    largest, below = w[POINTS + SORTED * n + count - 1], 0
    for i in range(n):
        if w[POINTS + RESIDUALS * n + i] < largest:
            below += 1
    for i in range(n):
        square, taken = w[POINTS + RESIDUALS * n + i], False
        if square < largest:
            taken = True
        elif square == largest and below < count:
            taken = True
            below += 1
        for k in range(3):
            w[POINTS + INFO * n + 3 * i + k] = (
                w[POINTS + WEIGHTS * n + 3 * i + k] if taken and square < math.inf else 0.0
            )


@compiled(NOTHING, W, WHOLE, WHOLE)
def fit(w, n, pose):
    """Gauss-Newton steps on the chosen points, each taken where it does not raise their squares."""
    before = math.inf
    for step in range(FIT_STEPS + 1):
        here = pose if step == 0 else PROPOSAL
        cost = derivatives(w, n, here, 0.0, GRADIENT, HESSIAN)
        if not cost <= before or not cost < math.inf:
            break
        if step > 0:
            copy(w, PROPOSAL, pose, 12)
        before = cost
        if step < FIT_STEPS:
            factorise(w, HESSIAN, 1e-12, FACTOR_PLACE)
            solve(w, FACTOR_PLACE, GRADIENT, MOVE)
            moved(w, pose, MOVE, PROPOSAL)


@compiled(NUMBER, W, WHOLE, WHOLE)
def distances(w, n, pose):
    """At RESIDUALS the squares over their variances for points of unit variance, given the pose of the chosen points;
    the sum of the squares of those.

    H = J C J^T is the pose's share of the variance. A point that took no part scatters by 1 + H; one that did by
    1 - H, and over 1 - H its square is the one that it would have, had it taken no part.
    """
    derivatives(w, n, pose, 0.0, GRADIENT, HESSIAN)
    factorise(w, HESSIAN, 1e-12, FACTOR_PLACE)
    inverse(w, FACTOR_PLACE, HESSIAN_NEW)
    total = 0.0
    U, V = SCRATCH + 130, SCRATCH + 136
    for i in range(n):
        o, e, j = POINTS + 3 * i, POINTS + SEEN * n + 2 * i, POINTS + WEIGHTS * n + 3 * i
        out = POINTS + RESIDUALS * n + i
        w[out] = math.inf
        a0 = w[pose] * w[o] + w[pose + 1] * w[o + 1] + w[pose + 2] * w[o + 2]
        a1 = w[pose + 3] * w[o] + w[pose + 4] * w[o + 1] + w[pose + 5] * w[o + 2]
        a2 = w[pose + 6] * w[o] + w[pose + 7] * w[o + 1] + w[pose + 8] * w[o + 2]
        x, y, z = a0 + w[pose + 9], a1 + w[pose + 10], a2 + w[pose + 11]
        s, s_q, s_z, _, _, _ = radial(w, x * x + y * y, z)
        u, v = s * x - w[e], s * y - w[e + 1]
        p, q, r = w[j], w[j + 1], w[j + 2]
        square = p * u * u + 2.0 * q * u * v + r * v * v
        if not square < math.inf:
            continue
        sign = 1.0
        if w[POINTS + INFO * n + 3 * i] > 0.0:
            sign = -1.0
            total += square
        w[U + 3], w[U + 4], w[U + 5] = s + 2.0 * x * x * s_q, 2.0 * x * y * s_q, x * s_z
        w[V + 3], w[V + 4], w[V + 5] = 2.0 * x * y * s_q, s + 2.0 * y * y * s_q, y * s_z
        for k in range(2):
            J = U + 6 * k
            w[J] = a1 * w[J + 5] - a2 * w[J + 4]
            w[J + 1] = a2 * w[J + 3] - a0 * w[J + 5]
            w[J + 2] = a0 * w[J + 4] - a1 * w[J + 3]
        uu = uv = vv = 0.0
        for k in range(6):
            cu = cv = 0.0
            for m in range(6):
                cu += w[HESSIAN_NEW + 6 * k + m] * w[U + m]
                cv += w[HESSIAN_NEW + 6 * k + m] * w[V + m]
            uu += w[U + k] * cu
            uv += w[U + k] * cv
            vv += w[V + k] * cv
        det = p * r - q * q
        uu, uv, vv = r / det + sign * uu, -q / det + sign * uv, p / det + sign * vv
        distance = (vv * u * u - 2.0 * uv * u * v + uu * v * v) / (uu * vv - uv * uv)
        if 0.0 <= distance < math.inf:
            w[out] = distance
    return total
