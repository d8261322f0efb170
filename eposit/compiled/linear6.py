"""Symmetric systems of six equations: H = L D L^T, and what a descent needs of it.

A factor is 42 numbers: L (6, 6), lower with a unit diagonal, then the diagonal of D. All is written out without loops,
so that numbers stay in the processor's registers.
"""

from __future__ import annotations

from eposit.compiled.kernel import NOTHING, NUMBER, TRUTH, WHOLE, W, compiled, part

LEAST_PIVOT = 1e-13  # of its diagonal entry: a pivot below it is rounding


@part((NUMBER, TRUTH), NUMBER, NUMBER)
def _pivot(value, diagonal):
    """A pivot, made positive, and whether it was not."""
    least = LEAST_PIVOT * abs(diagonal)
    if value > least:
        return value, False
    return max(abs(value), least), True


@compiled(WHOLE, W, WHOLE, NUMBER, WHOLE)
def factorise(w, H, damping, L):
    """The factor at L of the matrix at H, upper triangle, with its diagonal grown by `damping`.

    Returns the index of the first pivot that is not positive, 6 if none. Such pivots are turned positive, so that a
    solution is a direction of descent. With c = L D, column by column: l = c / d.
    """
    diagonal = w[H] + damping * abs(w[H])
    d0, bad0 = _pivot(diagonal, diagonal)
    c10, c20, c30, c40, c50 = w[H + 1], w[H + 2], w[H + 3], w[H + 4], w[H + 5]
    over = 1.0 / d0
    l10, l20, l30, l40, l50 = over * c10, over * c20, over * c30, over * c40, over * c50
    diagonal = w[H + 7] + damping * abs(w[H + 7])
    d1, bad1 = _pivot(diagonal - l10 * c10, diagonal)
    c21, c31, c41, c51 = w[H + 8] - l20 * c10, w[H + 9] - l30 * c10, w[H + 10] - l40 * c10, w[H + 11] - l50 * c10
    over = 1.0 / d1
    l21, l31, l41, l51 = over * c21, over * c31, over * c41, over * c51
    diagonal = w[H + 14] + damping * abs(w[H + 14])
    d2, bad2 = _pivot(diagonal - l20 * c20 - l21 * c21, diagonal)
    c32 = w[H + 15] - l30 * c20 - l31 * c21
    c42 = w[H + 16] - l40 * c20 - l41 * c21
    c52 = w[H + 17] - l50 * c20 - l51 * c21
    over = 1.0 / d2
    l32, l42, l52 = over * c32, over * c42, over * c52
    diagonal = w[H + 21] + damping * abs(w[H + 21])
    d3, bad3 = _pivot(diagonal - l30 * c30 - l31 * c31 - l32 * c32, diagonal)
    c43, c53 = w[H + 22] - l40 * c30 - l41 * c31 - l42 * c32, w[H + 23] - l50 * c30 - l51 * c31 - l52 * c32
    over = 1.0 / d3
    l43, l53 = over * c43, over * c53
    diagonal = w[H + 28] + damping * abs(w[H + 28])
    d4, bad4 = _pivot(diagonal - l40 * c40 - l41 * c41 - l42 * c42 - l43 * c43, diagonal)
    c54 = w[H + 29] - l50 * c40 - l51 * c41 - l52 * c42 - l53 * c43
    over = 1.0 / d4
    l54 = over * c54
    diagonal = w[H + 35] + damping * abs(w[H + 35])
    d5, bad5 = _pivot(diagonal - l50 * c50 - l51 * c51 - l52 * c52 - l53 * c53 - l54 * c54, diagonal)
    w[L + 6] = l10
    w[L + 12], w[L + 13] = l20, l21
    w[L + 18], w[L + 19], w[L + 20] = l30, l31, l32
    w[L + 24], w[L + 25], w[L + 26], w[L + 27] = l40, l41, l42, l43
    w[L + 30], w[L + 31], w[L + 32], w[L + 33], w[L + 34] = l50, l51, l52, l53, l54
    w[L + 36], w[L + 37], w[L + 38], w[L + 39], w[L + 40], w[L + 41] = d0, d1, d2, d3, d4, d5
    bad = 5 if bad5 else 6
    bad = 4 if bad4 else bad
    bad = 3 if bad3 else bad
    bad = 2 if bad2 else bad
    bad = 1 if bad1 else bad
    return 0 if bad0 else bad


@compiled(NOTHING, W, WHOLE, WHOLE)
def turn_up(w, L, x):
    """At x: L^-T x."""
    x5 = w[x + 5]
    x4 = w[x + 4] - w[L + 34] * x5
    x3 = w[x + 3] - w[L + 33] * x5 - w[L + 27] * x4
    x2 = w[x + 2] - w[L + 32] * x5 - w[L + 26] * x4 - w[L + 20] * x3
    x1 = w[x + 1] - w[L + 31] * x5 - w[L + 25] * x4 - w[L + 19] * x3 - w[L + 13] * x2
    x0 = w[x] - w[L + 30] * x5 - w[L + 24] * x4 - w[L + 18] * x3 - w[L + 12] * x2 - w[L + 6] * x1
    w[x], w[x + 1], w[x + 2], w[x + 3], w[x + 4] = x0, x1, x2, x3, x4


@compiled(NOTHING, W, WHOLE, WHOLE, WHOLE)
def solve(w, L, g, x):
    """At x: -H^-1 g."""
    x0 = -w[g]
    x1 = -w[g + 1] - w[L + 6] * x0
    x2 = -w[g + 2] - w[L + 12] * x0 - w[L + 13] * x1
    x3 = -w[g + 3] - w[L + 18] * x0 - w[L + 19] * x1 - w[L + 20] * x2
    x4 = -w[g + 4] - w[L + 24] * x0 - w[L + 25] * x1 - w[L + 26] * x2 - w[L + 27] * x3
    x5 = -w[g + 5] - w[L + 30] * x0 - w[L + 31] * x1 - w[L + 32] * x2 - w[L + 33] * x3 - w[L + 34] * x4
    w[x], w[x + 1], w[x + 2] = x0 / w[L + 36], x1 / w[L + 37], x2 / w[L + 38]
    w[x + 3], w[x + 4], w[x + 5] = x3 / w[L + 39], x4 / w[L + 40], x5 / w[L + 41]
    turn_up(w, L, x)


@compiled(NOTHING, W, WHOLE, WHOLE)
def inverse(w, L, out):
    """At out (6, 6): H^-1 = M^T D^-1 M with M = L^-1."""
    m10 = -w[L + 6]
    m20 = -w[L + 12] - w[L + 13] * m10
    m30 = -w[L + 18] - w[L + 19] * m10 - w[L + 20] * m20
    m40 = -w[L + 24] - w[L + 25] * m10 - w[L + 26] * m20 - w[L + 27] * m30
    m50 = -w[L + 30] - w[L + 31] * m10 - w[L + 32] * m20 - w[L + 33] * m30 - w[L + 34] * m40
    m21 = -w[L + 13]
    m31 = -w[L + 19] - w[L + 20] * m21
    m41 = -w[L + 25] - w[L + 26] * m21 - w[L + 27] * m31
    m51 = -w[L + 31] - w[L + 32] * m21 - w[L + 33] * m31 - w[L + 34] * m41
    m32 = -w[L + 20]
    m42 = -w[L + 26] - w[L + 27] * m32
    m52 = -w[L + 32] - w[L + 33] * m32 - w[L + 34] * m42
    m43 = -w[L + 27]
    m53 = -w[L + 33] - w[L + 34] * m43
    m54 = -w[L + 34]
    e0, e1, e2 = 1.0 / w[L + 36], 1.0 / w[L + 37], 1.0 / w[L + 38]
    e3, e4, e5 = 1.0 / w[L + 39], 1.0 / w[L + 40], 1.0 / w[L + 41]
    n10 = e1 * m10
    n20, n21 = e2 * m20, e2 * m21
    n30, n31, n32 = e3 * m30, e3 * m31, e3 * m32
    n40, n41, n42, n43 = e4 * m40, e4 * m41, e4 * m42, e4 * m43
    n50, n51, n52, n53, n54 = e5 * m50, e5 * m51, e5 * m52, e5 * m53, e5 * m54
    w[out] = e0 + m10 * n10 + m20 * n20 + m30 * n30 + m40 * n40 + m50 * n50
    w[out + 6] = w[out + 1] = n10 + m21 * n20 + m31 * n30 + m41 * n40 + m51 * n50
    w[out + 7] = e1 + m21 * n21 + m31 * n31 + m41 * n41 + m51 * n51
    w[out + 12] = w[out + 2] = n20 + m32 * n30 + m42 * n40 + m52 * n50
    w[out + 13] = w[out + 8] = n21 + m32 * n31 + m42 * n41 + m52 * n51
    w[out + 14] = e2 + m32 * n32 + m42 * n42 + m52 * n52
    w[out + 18] = w[out + 3] = n30 + m43 * n40 + m53 * n50
    w[out + 19] = w[out + 9] = n31 + m43 * n41 + m53 * n51
    w[out + 20] = w[out + 15] = n32 + m43 * n42 + m53 * n52
    w[out + 21] = e3 + m43 * n43 + m53 * n53
    w[out + 24] = w[out + 4] = n40 + m54 * n50
    w[out + 25] = w[out + 10] = n41 + m54 * n51
    w[out + 26] = w[out + 16] = n42 + m54 * n52
    w[out + 27] = w[out + 22] = n43 + m54 * n53
    w[out + 28] = e4 + m54 * n54
    w[out + 30] = w[out + 5] = n50
    w[out + 31] = w[out + 11] = n51
    w[out + 32] = w[out + 17] = n52
    w[out + 33] = w[out + 23] = n53
    w[out + 34] = w[out + 29] = n54
    w[out + 35] = e5
