"""The first map from board to image, through what a finder saw: corners of which some may be a few pixels off."""

from __future__ import annotations

import numpy as np

from pipelines.detection.board_map import SEEN_CORNERS, BoardMap, grid
from pipelines.detection.seen_points import SeenPoints
from render.targets.chessboard import Chessboard

CIRCLE_CLEARANCE = 1.3  # squares from the circle's foot within which a finder's corners are not trusted
LEAST_CLEAR = 7  # corners for a map; where fewer are clear of the circle all take part
OUTLIER_PX = 1.5  # a worst corner farther off than this has all corners weighed by their distances
GENTLE_PX = 0.5  # distance at which such a weight is one half


def first_map(seen: SeenPoints, size: tuple[int, int], target: Chessboard) -> BoardMap:
    """The map through the corners that a finder saw but those beside the circle, whose rim may be taken for an edge.

    size: width and height of the picture, px.
    """
    at = grid(target.inner)
    points, used = np.zeros((len(at), 2)), np.zeros(len(at), bool)
    points[seen.ids], used[seen.ids] = seen.points_px, True
    clear = used & (np.linalg.norm(at - target.circle_centre[:2] / target.square_mm, axis=1) > CIRCLE_CLEARANCE)
    if np.sum(clear) >= LEAST_CLEAR:
        used = clear
    board = BoardMap.fit(at, points, size, used.astype(np.float64), hold=SEEN_CORNERS)
    distance = np.linalg.norm(board(at) - points, axis=1)
    if distance[used].max() <= OUTLIER_PX:
        return board
    return BoardMap.fit(at, points, size, used / (1.0 + (distance / GENTLE_PX) ** 2), board, SEEN_CORNERS)
