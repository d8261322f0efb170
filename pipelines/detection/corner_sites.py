"""Where on a board corners are, how dark and light lie around them, and how far other print is."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import grid
from render.targets.chessboard import Chessboard

REACH = 0.55  # squares from a chessboard's corner that a fit may use


@dataclass(frozen=True, slots=True)
class CornerSites:
    """n places where two straight edges cross. Lengths are in squares, or whatever the board's unit is."""

    at: Array  # (n, 2)
    # (n,) sign of the contrast. `normal_angles` points one normal along x and the other against y, so that it is 1
    # where black lies at lower x and y of the corner and at higher x and y, and -1 where white does.
    sense: Array
    next_edge: float = 1.0  # distance of the next edge that crosses the corner's own
    reach: float = REACH  # what a fit may use of it at most
    least_reach: float = 0.25  # and at least, however blurred the next edge is
    clear: float = np.inf  # pixels farther than this from both edges see other print
    circled: Chessboard | None = None  # the board whose raised circle hides some of it

    def chosen(self, which: Mask | NDArray[np.integer[Any]]) -> CornerSites:
        """Some of the places."""
        return replace(self, at=self.at[which], sense=self.sense[which])

    def followed_by(self, other: CornerSites) -> CornerSites:
        """These places and behind them others of the same board."""
        return replace(self, at=np.vstack((self.at, other.at)), sense=np.append(self.sense, other.sense))


def chessboard_sites(target: Chessboard) -> CornerSites:
    """The inner corners of the chessboard with a circle."""
    at = grid(target.inner)
    return CornerSites(at, np.where(at.sum(axis=1) % 2 == 0, 1.0, -1.0), circled=target)
