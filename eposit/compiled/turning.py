"""More starts where a rotation is hardly known: a thin rod's about itself, any of an object no larger than its noise.

There the cost has more minima than perspective makes, as noise decides between them.
"""

from __future__ import annotations

import math

from eposit.compiled.departure import WEAK, weak_steps
from eposit.compiled.descent import moved
from eposit.compiled.kernel import NOTHING, NUMBER, WHOLE, W, compiled
from eposit.compiled.layout import COSTS, FACTORS, HESSIAN, MINIMA, MOVE, PLANE, STARTS
from eposit.compiled.linear6 import inverse
from eposit.compiled.search import descend_all, triangle_starts

UNCERTAIN = 0.08  # rad^2, from which the variance of the rotation asks for more starts, together 16 degrees
FIFTH, TWO_FIFTHS = 2.0 * math.tan(0.2 * math.pi), 2.0 * math.tan(0.4 * math.pi)  # Cayley's steps: 72 and 144 degrees


@compiled(NOTHING, W, WHOLE, NUMBER, NUMBER, NUMBER, WHOLE)
def turned_poses(w, pose, x, y, z, out):
    """At out (4, 12) the pose turned by 72, 144, 216 and 288 degrees about (x, y, z) through the object's centroid."""
    over = 1.0 / math.sqrt(x * x + y * y + z * z)
    for k in range(4):
        step = (FIFTH if k % 2 == 0 else TWO_FIFTHS) * (1.0 if k < 2 else -1.0) * over
        w[MOVE], w[MOVE + 1], w[MOVE + 2] = step * x, step * y, step * z
        w[MOVE + 3] = w[MOVE + 4] = w[MOVE + 5] = 0.0
        moved(w, pose, MOVE, out + 12 * k)


@compiled(WHOLE, W, WHOLE)
def minima_of_a_lost_one(w, n):
    """How many minima a triangle's pose leads to, turned about the object's long axis; none if it leads to none."""
    if triangle_starts(w, n, MINIMA) == 0:
        return 0
    x = y = z = 0.0
    for j in range(3):
        x += w[MINIMA + j] * w[PLANE + j]
        y += w[MINIMA + 3 + j] * w[PLANE + j]
        z += w[MINIMA + 6 + j] * w[PLANE + j]
    turned_poses(w, MINIMA, x, y, z, STARTS)
    return descend_all(w, n, 4, 0, 0.0)


@compiled(WHOLE, W, WHOLE, WHOLE, NUMBER)
def minima_by_turning(w, n, known, variance):
    """How many minima there are with those that turning the cheapest leads to, if it is uncertain, the cheapest first.

    variance: of residuals of unit weight; 0 where the residuals tell.
    """
    if known == 0:
        known = minima_of_a_lost_one(w, n)
        if known == 0:
            return 0
    scale = variance if variance > 0.0 else w[COSTS] / (2.0 * n - 6.0)
    inverse(w, FACTORS, HESSIAN)
    if scale * (w[HESSIAN] + w[HESSIAN + 7] + w[HESSIAN + 14]) < UNCERTAIN:
        return known
    weak_steps(w)
    turned_poses(w, MINIMA, w[WEAK], w[WEAK + 1], w[WEAK + 2], STARTS)
    turned_poses(w, MINIMA, w[WEAK + 6], w[WEAK + 7], w[WEAK + 8], STARTS + 48)
    return descend_all(w, n, 8, known, 0.0)
