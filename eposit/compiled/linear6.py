"""Symmetric systems of six equations: H = L D L^T, and what a descent needs of it.

A factor is 42 numbers: L (6, 6), lower with a unit diagonal, then the diagonal of D.
"""

from __future__ import annotations

from eposit.compiled.kernel import NOTHING, NUMBER, WHOLE, W, compiled

LEAST_PIVOT = 1e-13  # of its diagonal entry: a pivot below it is rounding


@compiled(WHOLE, W, WHOLE, NUMBER, WHOLE)
def factorise(w, H, damping, L):
    """The factor at L of the matrix at H, upper triangle, with its diagonal grown by `damping`.

    Returns the index of the first pivot that is not positive, 6 if none. Such pivots are turned positive, so that a
    solution is a direction of descent.
    """
    bad, d = 6, L + 36
    for j in range(6):
        whole = w[H + 7 * j] + damping * abs(w[H + 7 * j])
        pivot = whole
        for k in range(j):
            pivot -= w[L + 6 * j + k] * w[L + 6 * j + k] * w[d + k]
        least = LEAST_PIVOT * abs(whole)
        if not pivot > least:
            bad = min(bad, j)
            pivot = max(abs(pivot), least)
        w[d + j] = pivot
        for i in range(j + 1, 6):
            part = w[H + 6 * j + i]
            for k in range(j):
                part -= w[L + 6 * i + k] * w[L + 6 * j + k] * w[d + k]
            w[L + 6 * i + j] = part / pivot
    return bad


@compiled(NOTHING, W, WHOLE, WHOLE)
def turn_up(w, L, x):
    """At x: L^-T x."""
    for i in range(4, -1, -1):
        part = w[x + i]
        for k in range(i + 1, 6):
            part -= w[L + 6 * k + i] * w[x + k]
        w[x + i] = part


@compiled(NOTHING, W, WHOLE, WHOLE, WHOLE)
def solve(w, L, g, x):
    """At x: -H^-1 g."""
    for i in range(6):
        part = -w[g + i]
        for k in range(i):
            part -= w[L + 6 * i + k] * w[x + k]
        w[x + i] = part
    for i in range(6):
        w[x + i] /= w[L + 36 + i]
    turn_up(w, L, x)


@compiled(NOTHING, W, WHOLE, WHOLE)
def inverse(w, L, out):
    """At out (6, 6): H^-1."""
    for column in range(6):  # the inverse of L, below its diagonal
        for i in range(column, 6):
            part = 1.0 if i == column else 0.0
            for k in range(column, i):
                part -= w[L + 6 * i + k] * w[out + 6 * k + column]
            w[out + 6 * i + column] = part
    for i in range(6):  # L^-T D^-1 L^-1: row i needs the rows from i on alone
        for j in range(i + 1):
            part = 0.0
            for k in range(i, 6):
                part += w[out + 6 * k + i] * w[out + 6 * k + j] / w[L + 36 + k]
            w[out + 6 * i + j] = part
        for j in range(i):
            w[out + 6 * j + i] = w[out + 6 * i + j]
