"""The default method: object and image brought to a common scale, all minima, the lowest with its covariance."""

from __future__ import annotations

import math

from eposit.compiled.descent import moved
from eposit.compiled.kernel import NOTHING, NUMBER, POINTER, TRUTH, WHOLE, W, compiled
from eposit.compiled.layout import (
    ALTERNATIVES,
    AMBIGUOUS,
    CENTRE,
    COSTS,
    COVARIANCE,
    FACTORS,
    HESSIAN,
    ITERATIONS,
    KNOWN,
    MINIMA,
    MOVE,
    OTHER,
    OTHERS,
    POSE,
    PRICE,
    PROPOSAL,
    RESULT,
    RMSE,
    SCRATCH,
    SIZE,
    STATUS,
    STEPS,
    UNRELIABLE,
)  # fmt: skip
from eposit.compiled.linear6 import inverse
from eposit.compiled.model import cost_at
from eposit.compiled.observe import (
    COPLANAR,
    NOT_CONVERGED,
    OK,
    TOO_FEW,
    no_pose,
    observe,
    place,
    squares_px,
    weigh,
    write_pose,
)  # fmt: skip
from eposit.compiled.search import all_minima
from eposit.compiled.shape import DESCRIBED, ON_A_LINE, describe

IMAGE_CIRCLE_ALLOWANCE = 0.05  # share of the radius by which noise may lift a point over the image circle
FLOOR_PX = 1e-6  # RMSE that counts as rounding when costs are compared
DEVIATIONS = 3.0  # standard deviations from the minimum at which the cost is compared with its parabola
POWER_STEPS = 4
WEAK, LEAST = SCRATCH, SCRATCH + 12  # (2, 6) steps along the least known rotations; least ratio along each
LEAST_RATIO = 0.25  # by which the covariance is widened at most; it counts as unreliable long before


@compiled(NOTHING, W, WHOLE)
def weak_step(w, k):
    """At WEAK + 6 k a step of one standard deviation along the least known rotation (k = 0), or along the least known
    of those that are independent of it (k = 1). The inverse Hessian is at HESSIAN.

    The power method on the covariance of the rotation; any direction of large variance will do.
    """
    C, step = HESSIAN, WEAK + 6 * k
    x, y, z = 1.0, 1.0, 1.0
    p, q, r = w[WEAK], w[WEAK + 1], w[WEAK + 2]
    if k == 1:  # at right angles to the first
        x, y, z = q - r, r - p, p - q
    for _ in range(POWER_STEPS):
        a = w[C] * x + w[C + 1] * y + w[C + 2] * z
        b = w[C + 6] * x + w[C + 7] * y + w[C + 8] * z
        c = w[C + 12] * x + w[C + 13] * y + w[C + 14] * z
        if k == 1:
            along = (p * a + q * b + r * c) / (p * p + q * q + r * r)
            a, b, c = a - along * p, b - along * q, c - along * r
        size = math.sqrt(a * a + b * b + c * c)
        x, y, z = a / size, b / size, c / size
    for i in range(6):
        w[step + i] = w[C + 6 * i] * x + w[C + 6 * i + 1] * y + w[C + 6 * i + 2] * z
    size = math.sqrt(w[step] * x + w[step + 1] * y + w[step + 2] * z)
    for i in range(6):
        w[step + i] /= size


@compiled(NUMBER, W, WHOLE, NUMBER)
def departure(w, n, variance):
    """How far the cost is from its parabola along the two least known rotations: the largest |log| of their ratio in
    eight directions.

    The inverse Hessian is at HESSIAN; it grows along each of the two so that it states no more than the cost does.
    variance: of residuals of unit weight.
    """
    weak_step(w, 0)
    weak_step(w, 1)
    worst, expected = 0.0, DEVIATIONS * DEVIATIONS * variance
    w[LEAST] = w[LEAST + 1] = 1.0
    for side in range(8):
        angle = 0.25 * math.pi * side
        first, second = math.cos(angle) * math.sqrt(expected), math.sin(angle) * math.sqrt(expected)
        for i in range(6):
            w[MOVE + i] = first * w[WEAK + i] + second * w[WEAK + 6 + i]
        moved(w, MINIMA, MOVE, PROPOSAL)
        ratio = (cost_at(w, n, PROPOSAL) - w[COSTS]) / expected
        worst = max(worst, abs(math.log(ratio)) if ratio > 0.0 else math.inf)
        if side % 2 == 0:
            axis = LEAST + side // 2 % 2
            w[axis] = max(min(w[axis], ratio), LEAST_RATIO)
    for k in range(2):
        grow = 1.0 / w[LEAST + k] - 1.0
        for i in range(6):
            for j in range(6):
                w[HESSIAN + 6 * i + j] += grow * w[WEAK + 6 * k + i] * w[WEAK + 6 * k + j]
    return worst


@compiled(NOTHING, W, NUMBER, POINTER, WHOLE)
def write_covariance(w, scale, out, place):
    """At `place` of out (6, 6) scale times the inverse Hessian at HESSIAN, for the object's own origin and unit.

    t = c - R m moves by dc + [R m]_x r with the centroid c and the rotation vector r.
    """
    C, size = HESSIAN, w[SIZE]
    m0 = m1 = m2 = 0.0
    for j in range(3):
        m0 += w[MINIMA + j] * w[CENTRE + j]
        m1 += w[MINIMA + 3 + j] * w[CENTRE + j]
        m2 += w[MINIMA + 6 + j] * w[CENTRE + j]
    for j in range(6):  # T C with T = [[1, 0], [[R m]_x, size]]
        a, b, c = w[C + j], w[C + 6 + j], w[C + 12 + j]
        w[C + 18 + j] = size * w[C + 18 + j] - m2 * b + m1 * c
        w[C + 24 + j] = size * w[C + 24 + j] + m2 * a - m0 * c
        w[C + 30 + j] = size * w[C + 30 + j] - m1 * a + m0 * b
    for i in range(6):  # and that times T^T
        p, q = C + 6 * i, place + 6 * i
        a, b, c = w[p], w[p + 1], w[p + 2]
        out[q], out[q + 1], out[q + 2] = scale * a, scale * b, scale * c
        out[q + 3] = scale * (size * w[p + 3] - m2 * b + m1 * c)
        out[q + 4] = scale * (size * w[p + 4] + m2 * a - m0 * c)
        out[q + 5] = scale * (size * w[p + 5] - m1 * a + m0 * b)


@compiled(NOTHING, W, WHOLE, POINTER, WHOLE)
def write_others(w, known, out, place):
    """At `place` of out the minima after the lowest of `known`, then NaN."""
    for k in range(ALTERNATIVES):
        pose, there = MINIMA + 12 * (k + 1), place + OTHER * k
        if k + 1 >= known:
            no_pose(w, pose)
            w[COSTS + k + 1] = math.nan
        write_pose(w, pose, out, there)
        out[there + 12] = w[COSTS + k + 1]


@compiled(TRUTH, W, WHOLE, NUMBER, NUMBER)
def undecided(w, n, variance, decisive):
    """Whether the second minimum is nearly as likely as the first: -2 log of the likelihood ratio is below decisive."""
    gap = w[COSTS + 1] - w[COSTS]
    if variance > 0.0:
        return gap < decisive * variance
    least = n * FLOOR_PX * FLOOR_PX
    return (2.0 * n - 6.0) * math.log(1.0 + gap / (w[COSTS] + least)) < decisive


@compiled(WHOLE, W, WHOLE, WHOLE, POINTER, WHOLE, WHOLE)
def find_minima(w, n, whole, pixels, row, refine):
    """The status of the image `row`; its minima where that is OK, else NaN for the first. whole: from `describe`."""
    state, w[STEPS] = observe(w, n, pixels, row, IMAGE_CIRCLE_ALLOWANCE), 0.0
    if state == OK and whole != DESCRIBED:
        state = COPLANAR if whole == ON_A_LINE else TOO_FEW
    w[KNOWN] = 0.0
    if state == OK:
        w[KNOWN] = all_minima(w, n, refine)
        state = OK if w[KNOWN] > 0.0 else NOT_CONVERGED
    if state != OK:
        no_pose(w, MINIMA)
        w[COSTS] = w[FACTORS + 36] = math.nan
    return state


@compiled(NOTHING, W, WHOLE, POINTER, POINTER, POINTER, WHOLE, WHOLE, NUMBER, WHOLE, NUMBER, NUMBER, NUMBER, POINTER)
def solve_best(w, n, points, pixels, weights, m, b, variance, refine, decisive, bent, most, out):
    """Solve b images of the same points into out (b, RESULT).

    w: workspace with LENS and INTRINSICS written. points (n, 3); pixels (b, n, 2); weights (m, 3): inverse covariances
    in px^-2 (xx, xy, yy), m = n or 1 for all points. variance: what the weights are to be divided by, px^2; 0 where it
    is unknown and the residuals tell. refine: 1 to descend to minima. decisive: -2 log of the likelihood ratio below
    which two minima are not decided. bent: `departure` above which the covariance is unreliable; most: cost above
    which it is, too, as the residuals contradict the weights.
    """
    place(w, n, points)
    whole = describe(w, n)
    weigh(w, n, weights, m)
    plain = m == 1 and weights[0] == 1.0 and weights[1] == 0.0 and weights[2] == 1.0
    for row in range(b):
        o = RESULT * row
        state = find_minima(w, n, whole, pixels, row, refine)
        known, cost = int(w[KNOWN]), w[COSTS]
        out[o + STATUS], out[o + ITERATIONS], out[o + PRICE] = state, w[STEPS], cost
        write_pose(w, MINIMA, out, o + POSE)
        scale = variance if variance > 0.0 else cost / (2.0 * n - 6.0)
        inverse(w, FACTORS, HESSIAN)
        bends = known > 0 and refine == 1 and departure(w, n, max(scale, FLOOR_PX * FLOOR_PX)) > bent
        out[o + UNRELIABLE] = 1.0 if bends or (known > 0 and cost > most) else 0.0
        out[o + AMBIGUOUS] = 1.0 if known > 1 and undecided(w, n, variance, decisive) else 0.0
        write_covariance(w, scale, out, o + COVARIANCE)
        out[o + RMSE] = math.sqrt((cost if plain or known == 0 else squares_px(w, n, MINIMA)) / n)
        write_others(w, known, out, o + OTHERS)
