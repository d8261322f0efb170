"""Damped Gauss-Newton for many small problems whose unknowns are not those of a pose alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask, solve_or_nan, take_last

STEP_TOL = 1e-11  # relative step at which a problem is done, near the floor of double precision
FIRST_DAMPING = 1e-8
COST_FLOOR = 1e-12  # relative growth of a sum that counts as rounding, not as a worse step

Model = Callable[[Array, NDArray[np.int64]], tuple[Array, Array]]
"""Unknowns (k, m) of the problems `rows` (m,) to their residuals (r, m) and slopes (r, k, m)."""


@dataclass(frozen=True, slots=True)
class Minima:
    """Where m problems of k unknowns have ended."""

    x: Array  # (k, m) unknowns
    steps: NDArray[np.int64]  # (m,) steps tried
    converged: Mask  # (m,) the last step was below the tolerance; False where the limit ended the search

    def take(self, rows: NDArray[np.int64] | Mask) -> Minima:
        """Some of the problems."""
        return Minima(self.x[:, rows], self.steps[rows], self.converged[rows])


def damped_gauss_newton(model: Model, x: Array, limit: int) -> Minima:
    """Unknowns near x (k, m) at which m sums of squares are least.

    A problem has converged when each part of a step is at most STEP_TOL of its unknown. Those that have not go on up to
    `limit` steps. A step that raises a sum is not taken. Problems with NaN stay as they are.
    """
    found, rows = x.copy(), np.arange(x.shape[1])
    steps, converged = np.zeros(len(rows), np.int64), np.zeros(len(rows), bool)
    with np.errstate(all="ignore"):
        miss, slopes = model(x, rows)
        cost, damping = _total(miss**2), np.full(len(rows), FIRST_DAMPING)
        moving = np.isfinite(cost)
        for _ in range(limit):
            if not np.any(moving):
                break
            if 2 * np.count_nonzero(moving) <= len(rows):
                found[:, rows], left = x, np.flatnonzero(moving)
                x, miss, slopes, cost, damping = (take_last(part, left) for part in (x, miss, slopes, cost, damping))
                rows, moving = rows[left], np.ones(len(left), bool)
            step = _step(miss, slopes, damping)
            miss_new, slopes_new = model(x + step, rows)
            cost_new = _total(miss_new**2)
            better = moving & (cost_new <= cost * (1.0 + COST_FLOOR))
            ended = moving & np.all(np.abs(step) <= STEP_TOL * np.abs(x), axis=0)
            x, cost = np.where(better, x + step, x), np.where(better, cost_new, cost)
            miss, slopes = np.where(better, miss_new, miss), np.where(better, slopes_new, slopes)
            damping = damping * np.where(better, 0.1, 10.0)
            steps[rows] += moving
            converged[rows] |= ended
            moving &= ~ended & np.all(np.isfinite(step), axis=0)
    found[:, rows] = x
    return Minima(found, steps, converged)


def _step(miss: Array, slopes: Array, damping: Array) -> Array:
    """(k, m) solutions of the normal equations, their diagonal grown by `damping`; NaN where there is none."""
    rows = np.ascontiguousarray(slopes.transpose(2, 0, 1))  # (m, r, k)
    columns, diagonal = np.swapaxes(rows, 1, 2), np.arange(rows.shape[2])
    normal, right = columns @ rows, columns @ np.ascontiguousarray(miss.T)[..., None]
    normal[:, diagonal, diagonal] *= (1.0 + damping)[:, None]
    lost = ~np.all(np.isfinite(normal), axis=(1, 2))
    normal[lost], right[lost] = np.eye(len(diagonal)), np.nan
    return -solve_or_nan(normal, right)[..., 0].T


def _total(values: Array) -> Array:
    """Sum over the first axis in one order for any number of columns."""
    return np.cumsum(values, axis=0)[-1] if len(values) > 2 else values[0] + values[1]
