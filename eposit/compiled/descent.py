"""One pose to the minimum near it: Levenberg and Marquardt while steps are long, then Newton with the full Hessian."""

from __future__ import annotations

import math

from eposit.compiled.kernel import NOTHING, NUMBER, WHOLE, W, compiled, part
from eposit.compiled.layout import (
    COST,
    FLOOR,
    GRADIENT,
    GRADIENT_NEW,
    HESSIAN,
    HESSIAN_NEW,
    MINIMA,
    MOVE,
    PROPOSAL,
    STEPS,
    TWIN,
)  # fmt: skip
from eposit.compiled.linear6 import factorise, solve, turn_up
from eposit.compiled.model import cost_at, derivatives

LOST, MINIMUM, MERGED = 0, 1, 2
MAX_STEPS = 500  # a long object may need 300: its turn about itself is hardly seen
NEAR = 0.1  # rad and relative translation: from a step below it on the Hessian is the full one
SLOW = 3  # steps after which it is in any case
FIRST_DAMPING, LEAST_DAMPING, RAISED_DAMPING = 1e-6, 1e-9, 1e-3
LEAST_STEP = 1e-9  # rad and relative translation: a step below it that raises the cost ends at a border of the lens
STEP_TOL = 1e-13  # rad and relative translation of what remains after a step, foretold from the last two
SHORT = 1e-9  # rad and relative translation: a Newton step so short is the last, what remains is its square
GAIN_TOL = 1e-14  # relative decrease of the cost that a step may foretell at a minimum
COST_FLOOR = 1e-12  # relative growth of the cost that counts as rounding, not as a worse step
SAME = 1e-3  # rad and relative translation within which two poses are one minimum
KICK = 0.05  # rad: the step from a saddle
KICKS = 3


@compiled(NOTHING, W, WHOLE, WHOLE, WHOLE)
def copy(w, source, target, count):
    """Copy so many numbers."""
    for i in range(count):
        w[target + i] = w[source + i]


@compiled(NOTHING, W, WHOLE, WHOLE, WHOLE)
def moved(w, pose, move, out):
    """At out: the pose after a step (6). The rotation is Cayley's, exact to third order and always a rotation."""
    x, y, z = 0.5 * w[move], 0.5 * w[move + 1], 0.5 * w[move + 2]
    square = x * x + y * y + z * z
    gain = 2.0 / (1.0 + square)
    rest = 1.0 - gain * square
    for j in range(3):
        a, b, c = w[pose + j], w[pose + 3 + j], w[pose + 6 + j]
        along = gain * (x * a + y * b + z * c)
        w[out + j] = rest * a + along * x + gain * (y * c - z * b)
        w[out + 3 + j] = rest * b + along * y + gain * (z * a - x * c)
        w[out + 6 + j] = rest * c + along * z + gain * (x * b - y * a)
        w[out + 9 + j] = w[pose + 9 + j] + w[move + 3 + j]


@part(NUMBER, W, WHOLE)
def _size(w, pose):
    """Of the step at MOVE the larger of the rotation, rad, and the relative translation."""
    turn = shift = far = 0.0
    for i in range(3):
        turn += w[MOVE + i] * w[MOVE + i]
        shift += w[MOVE + 3 + i] * w[MOVE + 3 + i]
        far += w[pose + 9 + i] * w[pose + 9 + i]
    return math.sqrt(max(turn, shift / far))


@part(NUMBER, NUMBER, NUMBER)
def _limit(cost, floor):
    """Up to which another cost is no worse: residuals r and their rounding d, whose squares add up to `floor`, give
    (r + d)^2."""
    return cost * (1.0 + COST_FLOOR) + 2.0 * math.sqrt(cost * floor) + floor


@compiled(WHOLE, W, WHOLE, WHOLE)
def is_known(w, pose, count):
    """Whether the pose is one of the `count` minima."""
    for k in range(count):
        known = MINIMA + 12 * k
        turn = shift = far = 0.0
        for i in range(9):
            turn += (w[pose + i] - w[known + i]) ** 2
        for i in range(9, 12):
            shift += (w[pose + i] - w[known + i]) ** 2
            far += w[known + i] ** 2
        if max(0.5 * turn, shift / far) < SAME * SAME:
            return 1
    return 0


@compiled(NOTHING, W, WHOLE, WHOLE, WHOLE, WHOLE, NUMBER)
def _kick(w, n, pose, L, bad, size):
    """From a saddle along its negative curvature to the lower side, at PROPOSAL; the other side goes to TWIN."""
    for i in range(6):
        w[MOVE + i] = 1.0 if i == bad else 0.0
    turn_up(w, L, MOVE)
    factor = KICK / _size(w, pose)
    for i in range(6):
        w[MOVE + i] *= factor
    moved(w, pose, MOVE, PROPOSAL)
    for i in range(6):
        w[MOVE + i] = -w[MOVE + i]
    moved(w, pose, MOVE, TWIN)
    if cost_at(w, n, TWIN) < cost_at(w, n, PROPOSAL):
        for i in range(12):
            w[PROPOSAL + i], w[TWIN + i] = w[TWIN + i], w[PROPOSAL + i]


@compiled(NOTHING, W, WHOLE, WHOLE, NUMBER, NUMBER)
def _finish(w, n, pose, cost, floor):
    """The last step is taken unless it raises the cost; at COST what it then is."""
    moved(w, pose, MOVE, PROPOSAL)
    w[COST] = cost_at(w, n, PROPOSAL)
    if w[COST] <= _limit(cost, floor):
        copy(w, PROPOSAL, pose, 12)
    else:
        w[COST] = cost


@compiled(WHOLE, W, WHOLE, WHOLE, WHOLE, WHOLE, NUMBER)
def descend(w, n, pose, count, L, newton):
    """Take the pose to a minimum: LOST, MINIMUM or MERGED. STEPS grows by the steps taken.

    MERGED: it came to one of the `count` minima known already. After a MINIMUM its cost is at COST, the factor of its
    Hessian at L, and at TWIN is NaN or a pose on the other side of a saddle that was passed. newton: 1.0 to begin with
    the full Hessian, 0.0 with J^T J.
    """
    before, kicks, floor = math.inf, 0, w[FLOOR]
    damping = FIRST_DAMPING if newton == 0.0 else 0.0
    w[TWIN] = math.nan
    g, H, g_new, H_new = GRADIENT, HESSIAN, GRADIENT_NEW, HESSIAN_NEW
    cost = derivatives(w, n, pose, newton, g, H)
    for step in range(1, MAX_STEPS + 1):
        if not cost < math.inf:
            break
        w[STEPS] += 1.0
        bad = factorise(w, H, damping, L)
        solve(w, L, g, MOVE)
        size, gain = _size(w, pose), 0.0
        for i in range(6):
            gain -= w[g + i] * w[MOVE + i]
        settled = gain <= GAIN_TOL * cost + floor
        kicked = False
        if newton == 0.0:
            if settled:  # the Hessian decides whether this is a minimum
                newton, damping = 1.0, 0.0
                cost = derivatives(w, n, pose, newton, g, H)
                continue
        elif bad < 6:
            kicked = settled  # a saddle
        elif damping > 0.0 and size <= SHORT:
            damping = 0.0  # the next step tells
            continue
        elif damping == 0.0:
            ratio = size / before if before < math.inf else 1.0
            if settled or size <= SHORT or size * (ratio * ratio if ratio < 0.1 else 1.0) <= STEP_TOL:
                _finish(w, n, pose, cost, floor)
                return MINIMUM
        if kicked:
            if kicks == KICKS:
                break
            kicks += 1
            _kick(w, n, pose, L, bad, size)
            size = KICK
        else:
            moved(w, pose, MOVE, PROPOSAL)
        newton_new = 1.0 if size < NEAR or step >= SLOW else 0.0
        cost_new = derivatives(w, n, PROPOSAL, newton_new, g_new, H_new)
        if cost_new <= _limit(cost, floor):
            copy(w, PROPOSAL, pose, 12)
            g, H, g_new, H_new = g_new, H_new, g, H
            cost, newton, before = cost_new, newton_new, size
            damping = 0.1 * damping if damping > 10.0 * LEAST_DAMPING else 0.0
            if is_known(w, pose, count) == 1:
                return MERGED
        else:
            damping = max(10.0 * damping, RAISED_DAMPING)
            if size < LEAST_STEP:
                break
    return LOST
