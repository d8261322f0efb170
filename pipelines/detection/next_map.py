"""The map through corners that were fitted, and how far along an edge its form is good."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap
from pipelines.detection.consistency import Corners, hold_of
from pipelines.detection.edge_form_errors import FORM_SHARE

MISFIT_NOISE = 4.0  # mean squares of a corner's uncertainty that its distance from a good map may have


def next_map(corners: Corners, board: BoardMap, at: Array, size: tuple[int, int]) -> BoardMap:
    """The map through the corners; where it misses them, that from starts of its own, if it is better.

    A first map is made from corners that are good to a pixel, and holds the lens to a usual one.
    """
    weights, points = corners.consistent * 1.0, corners.points_px
    hold = hold_of(corners.covariance_px2, corners.consistent)
    near = BoardMap.fit(at, points, size, weights, board, hold)
    misfit, own = _misfit(corners, near, at)
    if misfit <= own:
        return near
    anew = BoardMap.fit_from_everywhere(at, points, size, weights, hold, board.lift)
    return anew if _misfit(corners, anew, at)[0] < misfit else near


def _misfit(corners: Corners, board: BoardMap, at: Array) -> tuple[float, float]:
    """Median squared distance, px^2, of the corners from a map, and what their own uncertainty makes of it."""
    good = corners.consistent
    misfit = np.median(np.sum((corners.points_px - board(at))[good] ** 2, axis=1))
    return float(misfit), float(np.median(np.trace(corners.covariance_px2[good], axis1=1, axis2=2)))


def form_reach(corners: Corners, board: BoardMap, at: Array) -> float:
    """Squares along an edge up to which its form, as the map has it, is good to the corners' uncertainty."""
    misfit, own = _misfit(corners, board, at)
    excess = max(misfit - MISFIT_NOISE * own, 0.0)
    return (own / (FORM_SHARE**2 * excess + 1e-12)) ** 0.25
