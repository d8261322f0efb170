"""All solutions of a problem that has several: poses with their costs, lowest cost first."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from eposit.pose import Pose


@dataclass(frozen=True, slots=True)
class Candidates:
    """The k solutions of one problem, or those of b problems, padded with NaN to the longest list."""

    poses: Pose  # R (k, 3, 3) and t (k, 3), or (b, k, 3, 3) and (b, k, 3)
    cost: Array  # (k,) or (b, k), ascending, in the unit of the solver's own cost; NaN where padded

    @property
    def count(self) -> NDArray[np.int64]:
        """Number of solutions: () or (b,)."""
        return np.sum(~np.isnan(self.cost), axis=-1)

    def first(self) -> Candidates:
        """Those of the single problem of a batch of one, without padding."""
        k = int(self.count[0])
        return Candidates(Pose(self.poses.R[0, :k], self.poses.t[0, :k]), self.cost[0, :k])


def table(row: NDArray[np.int64], values: Array, rows: int) -> Array:
    """(m, ...) values as (rows, k, ...), each in the row named by the ascending `row`, padded with NaN."""
    count = np.bincount(row, minlength=rows)
    place = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    out = np.full((rows, int(count.max(initial=0)), *values.shape[1:]), np.nan)
    out[row, place] = values
    return out


def join_candidates(parts: list[Candidates]) -> Candidates:
    """One batch from several, padded to the longest."""
    longest = max(part.cost.shape[1] for part in parts)
    R, t, cost = (
        np.concatenate([_padded(values, longest) for values in each])
        for each in zip(*((part.poses.R, part.poses.t, part.cost) for part in parts), strict=True)
    )
    return Candidates(Pose(R, t), cost)


def _padded(values: Array, k: int) -> Array:
    room = [(0, 0)] * values.ndim
    room[1] = (0, k - values.shape[1])
    return np.pad(values, room, constant_values=np.nan)
