"""The chessboard in an image, without any hint of where it is: which of its corners are seen, to about a pixel.

The lattice finder looks first (`pipelines.detection.lattice_finder`). OpenCV's sector-based finder, which takes minutes
over noise and textures, is given only a picture in which the lattice finder has seen most of a board.
"""

from __future__ import annotations

import cv2
import numpy as np
from scipy.spatial import cKDTree

from eposit.arrays import Array
from pipelines.detection.grey_picture import Grey
from pipelines.detection.identity import AnyChessboard
from pipelines.detection.lattice_finder import find_lattice
from pipelines.detection.lattice_growth import centred
from pipelines.detection.seen_points import SeenPoints
from pipelines.detection.statuses import PointStatus
from pipelines.detection.textured_region import textured_region
from pipelines.detection.time_limit import Check, unlimited

__all__ = ["Grey", "find_board", "find_sector_based", "subpix", "textured_region"]

LATTICE, SECTOR = "lattice", "sector"
SECTOR_FLAGS = cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_EXHAUSTIVE
SECTOR_MARGIN, SECTOR_APART = 2.0, 0.3  # longest squares: around the corners, and between a corner's two places
SUBPIX_WINDOW = (5, 5)
SUBPIX_STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)


def find_board(image: Grey, target: AnyChessboard, check_time: Check = unlimited) -> SeenPoints | PointStatus:
    """The corners that are seen, or the status of all where it is not known which they are."""
    lattice = find_lattice(image, target, check_time)
    if lattice is None:
        return PointStatus.BOARD_NOT_FOUND
    if lattice.status != PointStatus.OK:
        return lattice.status
    points = centred(image, lattice.points_px, lattice.side_px)
    return SeenPoints(lattice.ids, points, LATTICE, lattice.exchanged)


def find_sector_based(image: Grey, target: AnyChessboard, check_time: Check = unlimited) -> SeenPoints | PointStatus:
    """The board as `cv2.findChessboardCornersSB` alone sees it, to its own accuracy; it sees whole boards only.

    Which corner is which is what the lattice finder says of the place.
    """
    seen = find_board(image, target, check_time)
    whole = target.inner[0] * target.inner[1]
    if isinstance(seen, PointStatus):
        return seen
    if len(seen.ids) < whole:
        return PointStatus.BOARD_NOT_FOUND
    grid = seen.points_px.reshape(*target.inner[::-1], 2)
    side = max(float(np.linalg.norm(np.diff(grid, axis=k), axis=-1).max()) for k in range(2))
    around = SECTOR_MARGIN * side
    low = np.maximum(np.floor(seen.points_px.min(axis=0) - around), 0.0).astype(int)
    high = np.ceil(seen.points_px.max(axis=0) + around).astype(int) + 1
    part = np.ascontiguousarray(image[low[1] : high[1], low[0] : high[0]])
    found, corners = cv2.findChessboardCornersSB(part, target.inner, flags=SECTOR_FLAGS)
    if not found:
        return PointStatus.BOARD_NOT_FOUND
    nearby = cKDTree(corners.reshape(-1, 2) + low).query(seen.points_px)
    distance, nearest = np.asarray(nearby[0]), np.asarray(nearby[1])
    if len(set(nearest.tolist())) < whole or distance.max() > SECTOR_APART * side:
        return PointStatus.BOARD_NOT_FOUND
    return SeenPoints(seen.ids, (corners.reshape(-1, 2) + low)[nearest].astype(np.float64), SECTOR)


def subpix(image: Grey, corners_px: Array) -> Array:
    """Corners (n, 2) px as `cv2.cornerSubPix` moves them."""
    start = corners_px.astype(np.float32).reshape(-1, 1, 2)
    return cv2.cornerSubPix(image, start, SUBPIX_WINDOW, (-1, -1), SUBPIX_STOP).reshape(-1, 2).astype(np.float64)
