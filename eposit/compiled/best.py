"""The default method: object and image brought to a common scale, all minima, the lowest with its covariance."""

from __future__ import annotations

import math

from eposit.compiled.departure import departure
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
    OTHER,
    OTHERS,
    POSE,
    PRICE,
    RMSE,
    SIZE,
    STATUS,
    STEPS,
    UNRELIABLE,
)  # fmt: skip
from eposit.compiled.linear6 import inverse
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
    write_result,
)  # fmt: skip
from eposit.compiled.search import all_minima
from eposit.compiled.shape import DESCRIBED, ON_A_LINE, describe
from eposit.compiled.turning import minima_by_turning

IMAGE_CIRCLE_ALLOWANCE = 0.05  # share of the radius by which noise may lift a point over the image circle
FLOOR_PX = 1e-6  # RMSE that counts as rounding when costs are compared


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
    told = max(min(known - 1, ALTERNATIVES), 0)
    for k in range(told):
        there = place + OTHER * k
        write_pose(w, MINIMA + 12 * (k + 1), out, there, there + 9)
        out[there + 12] = w[COSTS + k + 1]
    for i in range(place + OTHER * told, place + OTHER * ALTERNATIVES):
        out[i] = math.nan


@compiled(TRUTH, W, WHOLE, NUMBER, NUMBER)
def undecided(w, n, variance, decisive):
    """Whether the second minimum is nearly as likely as the first: -2 log of the likelihood ratio is below decisive."""
    gap = w[COSTS + 1] - w[COSTS]
    if variance > 0.0:
        return gap < decisive * variance
    least = n * FLOOR_PX * FLOOR_PX
    return (2.0 * n - 6.0) * math.log(1.0 + gap / (w[COSTS] + least)) < decisive


@compiled(WHOLE, W, WHOLE, WHOLE, POINTER, WHOLE, WHOLE, NUMBER)
def find_minima(w, n, whole, pixels, row, refine, variance):
    """The status of the image `row`; its minima where that is OK, else NaN for the first. whole: from `describe`."""
    state, w[STEPS] = observe(w, n, pixels, row, IMAGE_CIRCLE_ALLOWANCE), 0.0
    if state == OK and whole != DESCRIBED:
        state = COPLANAR if whole == ON_A_LINE else TOO_FEW
    w[KNOWN] = 0.0
    if state == OK:
        w[KNOWN] = all_minima(w, n, refine)
        if refine == 1:
            w[KNOWN] = minima_by_turning(w, n, int(w[KNOWN]), variance)
        state = OK if w[KNOWN] > 0.0 else NOT_CONVERGED
    if state != OK:
        no_pose(w, MINIMA)
        w[COSTS] = w[FACTORS + 36] = math.nan
    return state


@compiled(
    NOTHING, W, WHOLE, POINTER, POINTER, POINTER, WHOLE, WHOLE, WHOLE, WHOLE, NUMBER, WHOLE, NUMBER, NUMBER, NUMBER,
    POINTER,
)  # fmt: skip
def solve_best(w, n, points, pixels, weights, m, b, first, stop, variance, refine, decisive, bent, most, out):
    """Solve the images from `first` to `stop` of b of the same points into out, RESULT numbers each, as in `layout`.

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
    for row in range(first, stop):
        o = POSE * row
        state = find_minima(w, n, whole, pixels, row, refine, variance)
        known, cost = int(w[KNOWN]), w[COSTS]
        out[o + STATUS], out[o + ITERATIONS], out[o + PRICE] = state, w[STEPS], cost
        write_result(w, out, b, row)
        scale = variance if variance > 0.0 else cost / (2.0 * n - 6.0)
        inverse(w, FACTORS, HESSIAN)
        bends = known > 0 and refine == 1 and departure(w, n, max(scale, FLOOR_PX * FLOOR_PX)) > bent
        out[o + UNRELIABLE] = 1.0 if bends or (known > 0 and cost > most) else 0.0
        out[o + AMBIGUOUS] = 1.0 if known > 1 and undecided(w, n, variance, decisive) else 0.0
        write_covariance(w, scale, out, COVARIANCE * b + 36 * row)
        out[o + RMSE] = math.sqrt((cost if plain or known == 0 else squares_px(w, n, MINIMA)) / n)
        write_others(w, known, out, OTHERS * b + OTHER * ALTERNATIVES * row)
