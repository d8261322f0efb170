"""What each detector says of one picture, in the board's order: ours, and OpenCV's two."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

OURS, CLASSIC, SECTOR = "ours", "classic", "sector"
DETECTORS = (OURS, CLASSIC, SECTOR)
REFUSED = "refused"  # the board or the picture is not taken
NOT_FOUND = "not_found"
SUBPIX_STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
CLASSIC_FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
SECTOR_FLAGS = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY


@dataclass(frozen=True)
class Answer:
    """Points of one picture: inner corners, then the disc's centre if the board has a disc."""

    points: np.ndarray  # (n, 2) px, NaN where nothing is told
    status: np.ndarray  # (n,) words
    covariance: np.ndarray | None = None  # (n, 2, 2)


def answer(detector, image, board):
    """What a detector finds, without any hint of where the board is."""
    return _ours(image, board) if detector == OURS else _opencv(detector, image, board)


def _ours(image, board):
    # Here, so that a child for OpenCV does not load the product.
    from pipelines.detection import detect_points

    count = board.inner[0] * board.inner[1] + board.disc
    try:
        found = detect_points(image, target_of(board))
    except ValueError:
        return Answer(np.full((count, 2), np.nan), np.full(count, REFUSED), np.full((count, 2, 2), np.nan))
    return Answer(found.points_px, found.status, found.covariance_px2)


def target_of(board):
    """The product's target for a board.

    Raises:
        ValueError: the product has none for it.
    """
    from render.targets.chessboard import Chessboard
    from render.targets.plain_chessboard import PlainChessboard

    sizes = {"columns": board.columns, "rows": board.rows, "square_mm": board.square}
    if not board.disc:
        return PlainChessboard(**sizes, margin_mm=board.margin * board.square)
    sizes |= {"circle_square": board.disc_square, "circle_radius_mm": board.disc_radius}
    sizes |= {"circle_height_mm": board.disc_height}
    try:
        return Chessboard(**sizes, margin_squares=board.margin)
    except ValueError:  # a margin that it does not take; the detection does not need it
        return Chessboard(**sizes)


def _opencv(detector, image, board):
    """As a careful user calls it: 8 bits of grey, no quick check, the accurate and exhaustive search."""
    grey = image if image.dtype == np.uint8 else np.rint(image / 257.0).astype(np.uint8)
    grey = cv2.cvtColor(grey, cv2.COLOR_BGR2GRAY) if grey.ndim == 3 else grey
    if detector == CLASSIC:
        found, corners = cv2.findChessboardCorners(grey, board.inner, flags=CLASSIC_FLAGS)
        corners = _subpix(grey, corners, board.inner) if found else None
    else:
        found, corners = cv2.findChessboardCornersSB(grey, board.inner, flags=SECTOR_FLAGS)
    count = board.inner[0] * board.inner[1]
    if not found:
        return Answer(np.full((count, 2), np.nan), np.full(count, NOT_FOUND))
    return Answer(np.asarray(corners, float).reshape(-1, 2), np.full(count, "ok"))


def _subpix(grey, corners, inner):
    """Refined in a window as large as the smallest square allows, up to 11 px to each side."""
    grid = corners.reshape(inner[1], inner[0], 2)
    side = min(np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in (0, 1))
    half = int(np.clip(0.35 * side, 2, 11))
    return cv2.cornerSubPix(grey, corners, (half, half), (-1, -1), SUBPIX_STOP)
