"""The fixed point of POSIT's iteration by Newton steps, for problems on which the iteration contracts.

There is one fixed point then, and the plain iteration ends in it, too, in two to three times as many steps.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask, cross, take_last
from eposit.posit.orthography import Orthography, third_axis

CONTRACTS = 0.5  # largest contraction with which it is used: far from 1, as noise keeps I and J from right angles
SINGLE_STEPS = 3  # steps in single precision after the first: on the paper's object errors of 4e-5, 9e-8 and 6e-8
DOUBLE_STEPS = 4  # steps in double precision at most; two are the rule
STEPS = 1 + SINGLE_STEPS + DOUBLE_STEPS


def fixed_points(system: Orthography, tol: float) -> tuple[Array, Mask, NDArray[np.int64]]:
    """I and J, (2, 3, b), where they have settled, (b,), and the number of steps, (b,).

    tol: they have where their next change is below this, relative to their length, if it is shortened as the last.
    All steps but the first take (1 - slope)^-1 (F(k) - k) with the slope where the first one ends.
    """
    k, gain = _coarse(system)
    b = k.shape[1]
    iterations = np.full(b, STEPS)
    settled, rows, part, before = np.zeros(b, bool), np.arange(b), system, np.zeros(b)
    for count in range(STEPS - DOUBLE_STEPS + 1, STEPS + 1):
        some = k if len(rows) == b else take_last(k, rows)
        scale, target = third_axis(part.axes(some))
        step = np.einsum("ijb,jb->ib", gain, target - some)
        some += step
        if len(rows) < b:
            k[:, rows] = some
        change = np.einsum("ib,ib->b", step, step)
        change /= scale * scale
        limit = (tol / part.contraction) ** 2  # I and J change by so much of the change of k at most
        good = (change <= limit) | (change * change <= limit * before)
        done, before = rows if np.all(good) else rows[good], change
        settled[done], iterations[done] = True, count
        if len(done) == len(rows):
            break
        if len(done):  # the others go on alone: no problem's result depends on which others are in the batch
            left = np.flatnonzero(~good)
            rows, part, gain, before = rows[left], part.take(left), take_last(gain, left), take_last(before, left)
    return system.axes(k), settled, iterations


def _coarse(system: Orthography) -> tuple[Array, Array]:
    """k, (3, b), after the steps in single precision, and the gain (3, 3, b)."""
    coarse = system.astype(np.float32)
    _, k = third_axis(coarse.axes(None))
    axes = coarse.axes(k)
    scale, target = third_axis(axes)
    gain = _gain(coarse, axes, scale, target)
    k += np.einsum("ijb,jb->ib", gain, target - k)
    for _ in range(SINGLE_STEPS - 1):
        k += np.einsum("ijb,jb->ib", gain, third_axis(coarse.axes(k))[1] - k)
    return k.astype(np.float64), gain.astype(np.float64)


def _gain(system: Orthography, axes: Array, scale: Array, k: Array) -> Array:
    """(3, 3, b) inverses of 1 minus the slope of F, as `Orthography.of` gives it."""
    over = 1.0 / (scale * scale)
    along = np.einsum("aib,aikb->kb", axes, system.pull)
    along *= 0.5 * over
    across = np.einsum("ib,aikb->akb", k, system.pull)
    across *= over
    matrix = np.einsum("aib,akb->ikb", axes, across)
    matrix -= k[:, None] * along
    for i in range(3):
        matrix[i, i] += 1.0
    inverse = np.empty_like(matrix)
    for i, j, k_ in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        inverse[:, i] = cross(matrix[j], matrix[k_])
    inverse /= np.einsum("ib,ib->b", matrix[0], inverse[:, 0])
    return inverse
