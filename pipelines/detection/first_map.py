"""The first map from board to image, through what a finder saw: corners of which some may be a few pixels off."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap, grid
from render.targets.chessboard import Chessboard

CIRCLE_CLEARANCE = 1.3  # squares from the circle's foot within which a finder's corners are not trusted
FIRM_HOLD = 1.0  # of the lens near its start: see `BoardMap.fit`
OUTLIER_PX = 1.5  # a worst corner farther off than this has all corners weighed by their distances
GENTLE_PX = 0.5  # distance at which such a weight is one half


def first_map(corners_px: Array, size: tuple[int, int], target: Chessboard) -> BoardMap:
    """The map through a finder's corners (n, 2) px but those beside the circle, whose rim may be taken for an edge.

    size: width and height of the picture, px.
    """
    at = grid(target.inner)
    clear = np.linalg.norm(at - target.circle_centre[:2] / target.square_mm, axis=1) > CIRCLE_CLEARANCE
    board = BoardMap.fit(at, corners_px, size, clear.astype(np.float64), hold=FIRM_HOLD)
    distance = np.linalg.norm(board(at) - corners_px, axis=1)
    if distance[clear].max() <= OUTLIER_PX:
        return board
    return BoardMap.fit(at, corners_px, size, clear / (1.0 + (distance / GENTLE_PX) ** 2), board, FIRM_HOLD)
