"""Least-squares descent: Levenberg-Marquardt while steps are long, then steps of one matrix until they vanish.

Near a minimum the information matrix hardly changes, and most of the work goes into it. So each pose takes damped
Gauss-Newton steps until one is shorter than NEAR, and from there steps with the matrix of that place. These still
end where the gradient is zero; a pose whose steps do not shrink fast enough goes back to a matrix of its own each step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask, take_last
from eposit.pose import PoseBatch
from eposit.refine.ldl6 import LEAST_PIVOT, factorise, inverse, solve
from eposit.refine.reprojection import Equations, Observations, cost, equations, gradient, residuals

STEP_TOL = 1e-11  # rad and relative translation; the floor of double precision is about 1e-13
COST_FLOOR = 1e-12  # relative growth of the cost that counts as rounding, not as a worse step
MAX_STEPS = 50
NEAR = 0.1  # rad and relative translation: a step below it may be the last with a matrix of its own
REST_TOL = 1e-13  # the same of what remains after a step, judged by how much the steps shrink
STUCK = 0.9  # shrinkage of steps below STEP_TOL from which they are rounding
SHRINK = 0.2  # least shrinkage of the steps with one matrix
NEAR_STEPS = 16
FRESH = 1e-3  # step up to which the matrix serves as that of the minimum: covariances are good to as much


@dataclass(frozen=True, slots=True)
class RefinedPoses:
    """Poses of least cost near their starts."""

    poses: PoseBatch
    cost: Array  # (b,) sums of squared residuals, infinite where a point cannot be projected
    spread: Array  # (6, 6, b) inverse information matrices: the covariance for residuals of variance 1

    def take(self, rows: NDArray[np.int64]) -> RefinedPoses:
        """Some of the rows."""
        return RefinedPoses(self.poses.take(rows), self.cost[rows], take_last(self.spread, rows))

    def replace(self, rows: NDArray[np.int64], other: RefinedPoses) -> None:
        """Overwrite some rows with those of another result."""
        poses, new = self.poses, other.poses
        poses.R[..., rows], poses.t[:, rows] = new.R, new.t
        poses.iterations[rows], poses.converged[rows] = new.iterations, new.converged
        self.cost[rows], self.spread[..., rows] = other.cost, other.spread


def descend(view: Observations, start: PoseBatch) -> RefinedPoses:
    """Local minima. Rows with NaN do not converge and have an infinite cost."""
    with np.errstate(all="ignore"):
        near, model = _damped(view, start.R, start.t, equations(view, start.R, start.t), NEAR)
        factor = factorise(model.normal)
        spread = inverse(factor)
        alive = near.converged & (factor.relative > LEAST_PIVOT)
        found, first = _with_one_matrix(view, near, spread, model.gradient, alive)
        left = np.flatnonzero(~found.converged & np.isfinite(model.cost))
        if len(left):
            some = view.take(left), take_last(near.R, left), take_last(near.t, left), _part(model, left)
            found.put(left, _damped(*some, STEP_TOL)[0])
        stale = np.flatnonzero(found.converged & ~(first <= FRESH))
        if len(stale):
            here = equations(view.take(stale), take_last(found.R, stale), take_last(found.t, stale))
            spread[..., stale] = inverse(factorise(here.normal))
        found = PoseBatch(found.R, found.t, found.iterations + start.iterations, found.converged)
        return RefinedPoses(found, cost(residuals(view, found.R, found.t)), spread)


def _damped(
    view: Observations,
    turn: Array,
    t: Array,
    model: Equations,
    tol: float,
    damping: Array | float = 1e-6,
    before: Array | None = None,
    steps: int = MAX_STEPS,
) -> tuple[PoseBatch, Equations]:
    """At most so many steps of Levenberg and Marquardt until one is below `tol`; the equations at the poses reached."""
    b = t.shape[1]
    alive = np.isfinite(model.cost)
    counts, done = np.zeros(b, np.int64), np.zeros(b, bool)
    for step in range(1, steps + 1):
        move = solve(factorise(model.normal, damping + 1e-15), -model.gradient)
        turn_new, t_new = moved(turn, t, move)
        proposal, size = equations(view, turn_new, t_new), _size(move, t)
        better = alive & (proposal.cost <= model.cost * (1.0 + COST_FLOOR))
        before = size if before is None else before
        ended = (size <= STEP_TOL) & (
            (size * size <= REST_TOL * (before - size)) | (size >= STUCK * before) | (step == steps)
        )
        if tol > STEP_TOL:
            ended |= (size <= tol) & (better | (size <= STEP_TOL))
        ended &= alive
        if np.all(better):
            turn, t, model = turn_new, t_new, proposal
        else:
            turn, t, model = (
                np.where(better, turn_new, turn),
                np.where(better, t_new, t),
                _either(better, proposal, model),
            )
        counts, done, alive = counts + alive, done | ended, alive & ~ended
        rows = np.flatnonzero(alive)
        if not len(rows):
            break
        damping = np.where(better, damping * 0.1, np.maximum(damping, 1e-7) * 10.0)
        if len(rows) <= b // 2 and step < steps:
            parts = view.take(rows), take_last(turn, rows), take_last(t, rows), _part(model, rows)
            rest, rest_model = _damped(*parts, tol, damping[rows], size[rows], steps - step)
            found = PoseBatch(turn.copy(), t.copy(), counts, done)
            found.put(rows, rest)
            return found, _put(model, rows, rest_model)
        before = size
    return PoseBatch(turn, t, counts, done), model


def _with_one_matrix(
    view: Observations,
    near: PoseBatch,
    spread: Array,
    slope: Array,
    alive: Mask,
    before: Array | None = None,
    steps: int = NEAR_STEPS,
) -> tuple[PoseBatch, Array]:
    """At most so many steps with the given inverse matrix until they vanish, for the rows that are `alive`.

    Apart from `_damped` because it forms gradients only, never the matrix, which is most of a step's work: `_damped`
    alone takes 1.5 to 1.7 times as long for 20 or 54 points, and 1.1 to 1.3 times for 4000 images of four.
    Also the sizes of the first steps, (b,).
    """
    b = len(alive)
    turn, t, first = near.R, near.t, np.full(b, np.inf)
    counts, done = near.iterations.copy(), np.zeros(b, bool)
    for step in range(1, steps + 1):
        move = np.where(alive, np.einsum("ijb,jb->ib", spread, -slope), 0.0)
        size = _size(move, t)
        first = np.where(alive, size, np.inf) if step == 1 else first
        last = 2.0 * size / SHRINK if before is None else before  # the first need not shrink
        turn, t = moved(turn, t, move)
        ended = alive & ((size <= REST_TOL) | (size * size <= REST_TOL * last))
        counts, done, alive = counts + alive, done | ended, alive & ~ended & (size <= SHRINK * last)
        rows = np.flatnonzero(alive)
        if not len(rows):
            break
        if len(rows) <= b // 2 and step < steps:
            part, start = (
                view.take(rows),
                PoseBatch(take_last(turn, rows), take_last(t, rows), np.zeros(len(rows), np.int64), alive),
            )
            slope, alive = gradient(part, start.R, start.t), np.ones(len(rows), bool)
            rest, _ = _with_one_matrix(part, start, take_last(spread, rows), slope, alive, size[rows], steps - step)
            found = PoseBatch(turn.copy(), t.copy(), counts, done)
            found.put(rows, rest)
            return found, first
        slope, before = gradient(view, turn, t), size
    return PoseBatch(turn, t, counts, done), first


def moved(R: Array, t: Array, move: Array) -> tuple[Array, Array]:
    """Poses after the steps (6, b). The rotation is Cayley's, exact to third order and always a rotation."""
    half = 0.5 * move[:3]
    square = np.einsum("ib,ib->b", half, half)
    gain = 2.0 / (1.0 + square)
    scaled = gain * half
    turn = scaled[:, None] * half  # I + gain (half^x + half half^T - |half|^2 I)
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        turn[i, j] -= scaled[k]
        turn[j, i] += scaled[k]
        turn[i, i] += 1.0 - gain * square
    return np.einsum("ikb,kjb->ijb", turn, R), t + move[3:]


def _size(move: Array, t: Array) -> Array:
    turn, shift, far = (np.einsum("ib,ib->b", vector, vector) for vector in (move[:3], move[3:], t))
    return np.sqrt(np.maximum(turn, shift / far))


def _either(first: Mask, a: Equations, b: Equations) -> Equations:
    return Equations(
        np.where(first, a.cost, b.cost),
        np.where(first, a.gradient, b.gradient),
        np.where(first, a.normal, b.normal),
    )


def _part(model: Equations, rows: NDArray[np.int64]) -> Equations:
    return Equations(model.cost[rows], take_last(model.gradient, rows), take_last(model.normal, rows))


def _put(model: Equations, rows: NDArray[np.int64], part: Equations) -> Equations:
    """A copy of the model with some rows replaced."""
    whole = Equations(model.cost.copy(), model.gradient.copy(), model.normal.copy())
    whole.cost[rows], whole.gradient[:, rows], whole.normal[..., rows] = part.cost, part.gradient, part.normal
    return whole
