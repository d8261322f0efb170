"""Damped Gauss-Newton for many small problems whose unknowns are not those of a pose alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from eposit.arrays import Array, solve_or_nan

STEP_TOL = 1e-11  # relative step at which a problem is done, near the floor of double precision
FIRST_DAMPING = 1e-8
COST_FLOOR = 1e-12  # relative growth of a sum that counts as rounding, not as a worse step

Model = Callable[[Array], tuple[Array, Array]]  # (k, m) unknowns to (r, m) residuals and (r, k, m) slopes


def damped_gauss_newton(model: Model, x: Array, steps: int) -> Array:
    """Unknowns (k, m) near x at which m sums of squares are least, after so many steps at most.

    A step that raises a sum is not taken. Problems with NaN stay as they are.
    """
    with np.errstate(all="ignore"):
        miss, slopes = model(x)
        cost, damping = _total(miss**2), np.full(x.shape[1], FIRST_DAMPING)
        moving = np.isfinite(cost)
        for _ in range(steps):
            if not np.any(moving):
                break
            step = _step(miss, slopes, damping)
            miss_new, slopes_new = model(x + step)
            cost_new = _total(miss_new**2)
            better = moving & (cost_new <= cost * (1.0 + COST_FLOOR))
            x, cost = np.where(better, x + step, x), np.where(better, cost_new, cost)
            miss, slopes = np.where(better, miss_new, miss), np.where(better, slopes_new, slopes)
            damping = damping * np.where(better, 0.1, 10.0)
            moving &= np.max(np.abs(step) / np.abs(x), axis=0) > STEP_TOL
    return x


def _step(miss: Array, slopes: Array, damping: Array) -> Array:
    """(k, m) solutions of the normal equations, their diagonal grown by `damping`; NaN where there is none."""
    rows = np.ascontiguousarray(slopes.transpose(2, 0, 1))  # (m, r, k)
    columns, diagonal = np.swapaxes(rows, 1, 2), np.arange(rows.shape[2])
    normal, right = columns @ rows, columns @ miss.T[..., None]
    normal[:, diagonal, diagonal] *= (1.0 + damping)[:, None]
    lost = ~np.all(np.isfinite(normal), axis=(1, 2))
    normal[lost], right[lost] = np.eye(len(diagonal)), np.nan
    return -solve_or_nan(normal, right)[..., 0].T


def _total(values: Array) -> Array:
    """Sum over the first axis in one order for any number of columns."""
    return np.cumsum(values, axis=0)[-1] if len(values) > 2 else values[0] + values[1]
