"""The default method: object and image brought to a common scale, all minima, the lowest with its covariance."""

from __future__ import annotations

import math

from eposit.compiled.descent import moved
from eposit.compiled.jit import NUMBER, WHOLE, W, compiled, entry, part, pointer
from eposit.compiled.layout import (
    CENTRE,
    COSTS,
    FACTORS,
    HESSIAN,
    MINIMA,
    MOVE,
    PROPOSAL,
    SCRATCH,
    SIZE,
    STEPS,
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
DEVIATIONS = 2.0  # standard deviations from the minimum at which the cost is compared with its parabola
POWER_STEPS = 4  # of the power method; any direction of large variance will do


@compiled(NUMBER, W, WHOLE, NUMBER)
def departure(w, n, variance):
    """How far the cost is from its parabola along the least known rotation.

    The larger |log| of their ratio on two sides. The inverse Hessian is at HESSIAN. variance: of residuals of unit
    weight.
    """
    x, y, z = 1.0, 1.0, 1.0
    C = HESSIAN
    for _ in range(POWER_STEPS):
        a = w[C] * x + w[C + 1] * y + w[C + 2] * z
        b = w[C + 6] * x + w[C + 7] * y + w[C + 8] * z
        c = w[C + 12] * x + w[C + 13] * y + w[C + 14] * z
        size = math.sqrt(a * a + b * b + c * c)
        x, y, z = a / size, b / size, c / size
    for i in range(6):
        w[SCRATCH + i] = w[C + 6 * i] * x + w[C + 6 * i + 1] * y + w[C + 6 * i + 2] * z
    total = w[SCRATCH] * x + w[SCRATCH + 1] * y + w[SCRATCH + 2] * z
    worst, expected = 0.0, DEVIATIONS * DEVIATIONS * variance
    for side in range(2):
        factor = (1.0 - 2.0 * side) * math.sqrt(expected / total)
        for i in range(6):
            w[MOVE + i] = factor * w[SCRATCH + i]
        moved(w, MINIMA, MOVE, PROPOSAL)
        ratio = (cost_at(w, n, PROPOSAL) - w[COSTS]) / expected
        worst = max(worst, abs(math.log(ratio)) if ratio > 0.0 else math.inf)
    return worst


@part
def write_covariance(w, scale, out, row):
    """In row `row` of out (b, 6, 6) scale times the inverse Hessian at HESSIAN, for the object's own origin and unit.

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
        p = C + 6 * i
        a, b, c = w[p], w[p + 1], w[p + 2]
        out[row, i, 0], out[row, i, 1], out[row, i, 2] = scale * a, scale * b, scale * c
        out[row, i, 3] = scale * (size * w[p + 3] - m2 * b + m1 * c)
        out[row, i, 4] = scale * (size * w[p + 4] + m2 * a - m0 * c)
        out[row, i, 5] = scale * (size * w[p + 5] - m1 * a + m0 * b)


@part
def write_others(w, known, R, t, costs, row):
    """In row `row` of R (b, k, 3, 3), t (b, k, 3) and costs (b, 1 + k) the minima after the lowest, then NaN."""
    for k in range(len(costs[row]) - 1):
        pose = MINIMA + 12 * (k + 1)
        if k + 1 >= known:
            no_pose(pointer(w), pose)
            w[COSTS + k + 1] = math.nan
        write_pose(w, pose, R[row], t[row], k)
        costs[row, k + 1] = w[COSTS + k + 1]


@entry(
    "void(f8[::1],i8,f8[:,::1],f8[:,:,::1],f8[:,::1],f8,b1,f8,f8,i1[::1],f8[:,:,::1],f8[:,::1],f8[:,:,::1],f8[::1],"
    "i8[::1],f8[:,:,:,::1],f8[:,:,::1],f8[:,::1],b1[:,::1])"
)
def solve_best(
    w, n, points, pixels, weights, variance, refine, decisive, bent, status, R, t, covariance, rmse, iterations,
    other_R, other_t, costs, flags,
):  # fmt: skip
    """Solve b images of the same points.

    w: workspace with LENS and INTRINSICS written. weights (m, 3): inverse covariances in px^-2 (xx, xy, yy), m = n or 1
    for all points. variance: what the weights are to be divided by, px^2; 0 where it is unknown and the residuals tell.
    decisive: -2 log of the likelihood ratio below which two minima are not decided. bent: `departure` above which the
    covariance is unreliable. costs (b, 1 + k): of the pose, then of the k alternatives. flags (b, 2): ambiguous,
    covariance unreliable.
    """
    p = pointer(w)
    place(w, n, points)
    whole = describe(p, n)
    weigh(w, n, weights)
    plain = len(weights) == 1 and weights[0, 0] == 1.0 and weights[0, 1] == 0.0 and weights[0, 2] == 1.0
    dof = 2.0 * n - 6.0
    for row in range(len(pixels)):
        state, known = observe(w, n, pixels, row, IMAGE_CIRCLE_ALLOWANCE), 0
        w[STEPS] = 0.0
        if state == OK and whole != DESCRIBED:
            state = COPLANAR if whole == ON_A_LINE else TOO_FEW
        if state == OK:
            known = all_minima(p, n, 1 if refine else 0)
            state = OK if known > 0 else NOT_CONVERGED
        if known == 0:
            no_pose(p, MINIMA)
            w[COSTS] = w[FACTORS + 36] = math.nan
        cost = w[COSTS]
        status[row], iterations[row] = state, int(w[STEPS])
        write_pose(w, MINIMA, R, t, row)
        scale = variance if variance > 0.0 else cost / dof
        inverse(p, FACTORS, HESSIAN)
        flags[row, 0] = False
        flags[row, 1] = known > 0 and refine and departure(p, n, max(scale, FLOOR_PX * FLOOR_PX)) > bent
        write_covariance(w, scale, covariance, row)
        rmse[row] = math.sqrt((cost if plain or known == 0 else squares_px(p, n, MINIMA)) / n)
        costs[row, 0] = cost
        write_others(w, known, other_R, other_t, costs, row)
        if known > 1:
            least = n * FLOOR_PX * FLOOR_PX
            gap = w[COSTS + 1] - cost
            if variance > 0.0:
                flags[row, 0] = gap < decisive * variance
            else:
                flags[row, 0] = dof * math.log(1.0 + gap / (cost + least)) < decisive
