"""POSIT, EPOSIT and centred EPOSIT: linear starts that iterate on scaled orthography.

The three share one iteration and differ in how image points become pinhole-equivalent points (x, y at depth 1):
POSIT takes them from the bearing, EPOSIT from the paper's G(theta), centred EPOSIT from bearings turned so that
M0's ray is the axis. Arrays here have the problems last: images (2, n, b), poses R (3, 3, b) and t (3, b).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask, take_last
from eposit.pose import PoseBatch
from eposit.posit.newton import CONTRACTS, STEPS, fixed_points
from eposit.posit.orthography import Orthography, third_axis

COMPRESS = 4  # finished problems leave the arrays when they are one in so many: leaving costs, and so does staying
NEWTON_TOL = 1e-6  # tolerance from which Newton steps pay


@dataclass(slots=True)
class _Results:
    """What the iteration ends in; rows that it has not reached, or that do not converge, are NaN."""

    axes: Array  # (2, 3, b) I and J
    iterations: NDArray[np.int64]  # (b,)
    converged: Mask  # (b,)

    def put(self, rows: NDArray[np.int64], axes: Array, good: Mask, count: NDArray[np.int64] | int) -> None:
        """Write some rows; those that are good have converged."""
        some = np.flatnonzero(good)
        self.axes[..., rows[some]], self.converged[rows[some]] = take_last(axes, some), True
        self.iterations[rows] = count


@dataclass(slots=True)
class _ActiveProblems:
    """The problems still iterated on."""

    rows: NDArray[np.int64]  # (a,) their numbers
    system: Orthography
    k: Array | None  # (3, a) the unknown; zero if None
    axes: Array  # (2, 3, a) I and J of the last step
    change: Array  # (a,) the square of their last change; 0 before the second step

    def keep(self, kept: NDArray[np.int64]) -> None:
        """Drop the others."""
        self.rows, self.system = self.rows[kept], self.system.take(kept)
        self.axes, self.change = take_last(self.axes, kept), take_last(self.change, kept)
        self.k = None if self.k is None else take_last(self.k, kept)


def posit(system: Orthography, tol: float, max_iterations: int, k: Array | None = None, step: float = 1.0) -> PoseBatch:
    """The fixed points of POSIT's iteration.

    tol: stop when I and J change by less than this, relative to their length, or would in the next step if that
        shortens the change as the last one did.
    k: (3, b) first guess, zero if None. step: fraction of each update that is taken.
    Source:
        Paper, equations 21 to 25; DeMenthon and Davis 1995. Where the iteration surely contracts and many steps are
        needed, Newton steps find the same point.
    """
    with np.errstate(all="ignore"):
        b = system.rest.shape[-1]
        newton = k is None and tol <= NEWTON_TOL and max_iterations >= STEPS
        rows = np.flatnonzero(system.contraction <= CONTRACTS) if newton else np.zeros(0, np.int64)
        solved = fixed_points(system if len(rows) == b else system.take(rows), tol) if len(rows) else None
        if solved is not None and len(rows) == b and np.all(solved[1]):
            return PoseBatch(*system.pose(solved[0]), solved[2], solved[1])
        found = _Results(np.full((2, 3, b), np.nan), np.zeros(b, np.int64), np.zeros(b, bool))
        if solved is not None:
            found.put(rows, *solved)
        _iterate(system, tol, max_iterations, k, step, found)
        return PoseBatch(*system.pose(found.axes), found.iterations, found.converged)


def _iterate(
    system: Orthography, tol: float, max_iterations: int, k: Array | None, step: float, found: _Results
) -> None:
    """The plain iteration on the rows that have not converged yet."""
    rows = np.flatnonzero(~found.converged & np.isfinite(system.contraction))
    if len(rows) < len(found.converged):
        system, k = system.take(rows), None if k is None else take_last(k, rows)
    problems = _ActiveProblems(rows, system, k, np.zeros((2, 3, len(rows))), np.zeros(len(rows)))
    active = np.ones(len(rows), bool)
    for count in range(1, max_iterations + 1):
        if not np.all(active) and COMPRESS * np.count_nonzero(active) <= (COMPRESS - 1) * len(active):
            kept = np.flatnonzero(active)
            problems.keep(kept)
            active = np.ones(len(kept), bool)
        if not len(active):
            break
        scale, small = _step(problems, tol, step, count)
        gone = active & (small | ~np.isfinite(scale))
        if np.any(gone) or count == max_iterations:
            gone = active if count == max_iterations else gone
            found.put(problems.rows[gone], problems.axes[..., gone], small[gone], count)
            active = active & ~gone


def _step(problems: _ActiveProblems, tol: float, step: float, count: int) -> tuple[Array, Mask]:
    """One step of the iteration; the scale, and where I and J have settled."""
    axes = problems.system.axes(problems.k)
    scale, target = third_axis(axes)
    problems.k = target if step == 1.0 else step * target + (0.0 if problems.k is None else (1.0 - step) * problems.k)
    moved = axes - problems.axes
    change = np.einsum("aib,aib->b", moved, moved)
    limit = (tol * scale) ** 2
    small = (
        (change <= limit) | (change * change <= limit * problems.change) if count > 1 else np.zeros(len(change), bool)
    )
    problems.axes, problems.change = axes, change if count > 1 else problems.change
    return scale, small
