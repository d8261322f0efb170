"""The default method: refine centred EPOSIT, and try every other start where that may have missed the best pose."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array, take_last
from eposit.pose import PoseBatch
from eposit.refine.ldl6 import factorise, inverse
from eposit.refine.minimise import RefinedPoses, descend
from eposit.refine.reprojection import Observations, cost, equations, residuals
from eposit.shape import Shape
from eposit.starts import centred_start, other_starts
from eposit.starts.p3p import ray_misfit


def best_poses(shape: Shape, view: Observations, rays: Array, refined: bool) -> RefinedPoses:
    """The poses of lowest cost. rays: (n, 3, b). refined: whether starts are refined before costs are compared."""
    first = centred_start(shape, rays)
    if first is None:
        return _lowest(_each_refined(view, other_starts(shape, rays), refined))
    found = _refined(view, first, refined)
    sure = found.poses.converged & refined
    if refined:
        misfit = ray_misfit(shape.points_in_obj, rays, found.poses.R, found.poses.t)
        sure &= shape.sure(found.poses.R, found.poses.t, misfit)
    unsure = np.flatnonzero(~sure)
    if len(unsure):
        part, part_rays = view.take(unsure), take_last(rays, unsure)
        others = _each_refined(part, other_starts(shape, part_rays), refined)
        found.replace(unsure, _lowest([found.take(unsure), *others]))
    return found


def _refined(view: Observations, start: PoseBatch, refined: bool) -> RefinedPoses:
    if refined:
        return descend(view, start)
    spread = inverse(factorise(equations(view, start.R, start.t).normal))
    return RefinedPoses(start, cost(residuals(view, start.R, start.t)), spread)


def _each_refined(view: Observations, found: list[PoseBatch], refined: bool) -> list[RefinedPoses]:
    """The starts of every problem, refined as one batch: NumPy's calls cost as much for few problems as for many."""
    b = view.seen.shape[-1]
    together = PoseBatch(
        np.concatenate([start.R for start in found], axis=-1),
        np.concatenate([start.t for start in found], axis=-1),
        np.concatenate([start.iterations for start in found]),
        np.concatenate([start.converged for start in found]),
    )
    every = _refined(view.take(np.tile(np.arange(b), len(found))), together, refined)
    return [every.take(np.arange(i * b, (i + 1) * b)) for i in range(len(found))]


def _lowest(candidates: list[RefinedPoses]) -> RefinedPoses:
    """For each problem the converged candidate of lowest cost; the earlier one where costs are equal."""
    best = candidates[0].take(np.arange(len(candidates[0].cost)))
    best.cost[~best.poses.converged] = np.inf
    for other in candidates[1:]:
        rows = np.flatnonzero(other.poses.converged & (other.cost < best.cost))
        best.replace(rows, other.take(rows))
    return best
