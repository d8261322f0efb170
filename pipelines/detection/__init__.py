"""Detection of one image: board, corners, circles. Nothing but the image and the target's dimensions goes in."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.board_map import grid
from pipelines.detection.circle import find_circle
from pipelines.detection.consistency import BAD_SHARE, Corners, check_placed
from pipelines.detection.corner_sites import chessboard_sites
from pipelines.detection.corners import refine_corners
from pipelines.detection.finders import Grey, find_board, find_sector_based, subpix
from pipelines.detection.first_map import first_map
from pipelines.detection.printed import check_seen, find_points, place_points
from render.targets.chessboard import Chessboard
from render.targets.kinds import AnyTarget
from render.targets.printed import PrintedBoard


class Detector(StrEnum):
    """How corners are placed once OpenCV has found the board. The circle is fitted by us with each of them."""

    EDGE_FIT = "edge-fit"  # ours: two blurred edges, least squares
    OPENCV_SUBPIX = "opencv-subpix"  # OpenCV's finder of the target, then cv2.cornerSubPix with half window 5
    OPENCV_SB = "opencv-sb"  # cv2.findChessboardCornersSB, exhaustive and accurate; for chessboards


class PointStatus(StrEnum):
    """Outcome for one point."""

    OK = "ok"
    BOARD_NOT_FOUND = "board_not_found"  # no finder saw a complete board
    CORNERS_INCONSISTENT = "corners_inconsistent"  # the corner, or too many of the board's, disagree with the others
    CIRCLE_NOT_FOUND = "circle_not_found"  # no dark disc where the board puts the circle
    POINT_NOT_FOUND = "point_not_found"  # of a printed board that was seen: outside the picture, covered, or unlike it


STATUS_TYPE = np.dtype(f"<U{max(len(status) for status in PointStatus)}")


@dataclass(frozen=True, slots=True)
class Detection:
    """Points of one image in the order of the target's `points`."""

    points_px: Array  # (n, 2), NaN where the status is not ok
    covariance_px2: Array  # (n, 2, 2) of each point, NaN likewise
    status: NDArray[np.str_]  # (n,) PointStatus values
    finder: str  # finder that saw the board, empty if none
    blur_px: float  # median blur of the edges, NaN if none


def detect_points(image: Grey, target: AnyTarget, detector: str = Detector.EDGE_FIT) -> Detection:
    """The target's points in an 8-bit image (height, width).

    Raises:
        ValueError: not a two-dimensional 8-bit image, an unknown detector, or one that does not take the target.
    """
    if image.ndim != 2 or image.dtype != np.uint8:
        raise ValueError(f"image has shape {image.shape} and type {image.dtype}; give 8-bit grey, (height, width)")
    if detector not in list(Detector):
        raise ValueError(f"unknown detector {detector!r}; choose one of {', '.join(Detector)}")
    if not takes_target(detector, target):
        raise ValueError(f"detector {str(detector)!r} finds chessboards only; choose another for {target.pattern!r}")
    if isinstance(target, Chessboard):
        return _detect_chessboard(image, target, detector)
    return _detect_printed(image, target, detector)


def takes_target(detector: str, target: AnyTarget) -> bool:
    """Whether a detector can find a kind of target."""
    return detector != Detector.OPENCV_SB or isinstance(target, Chessboard)


def _detect_printed(image: Grey, target: PrintedBoard, detector: str) -> Detection:
    count = len(target.points)
    seen = find_points(image, target)
    if seen is None:
        return _nothing(count, PointStatus.BOARD_NOT_FOUND, "")
    try:
        placed = place_points(image, seen, target)
    except np.linalg.LinAlgError:  # points that no camera could see
        return _nothing(count, PointStatus.CORNERS_INCONSISTENT, seen.finder)
    if detector == Detector.OPENCV_SUBPIX and np.any(placed.consistent):
        placed = check_seen(image, seen, placed, target)
    good = placed.consistent
    if np.mean(~good[seen.ids]) > BAD_SHARE:
        return _nothing(count, PointStatus.CORNERS_INCONSISTENT, seen.finder)
    status = np.where(good, PointStatus.OK, PointStatus.POINT_NOT_FOUND).astype(STATUS_TYPE)
    points = np.where(good[:, None], placed.points_px, np.nan)
    return Detection(
        points, np.where(good[:, None, None], placed.covariance_px2, np.nan), status, seen.finder, placed.blur_px
    )


def _detect_chessboard(image: Grey, target: Chessboard, detector: str) -> Detection:
    """Corners and circle."""
    count = len(target.points)
    found = find_sector_based(image, target) if detector == Detector.OPENCV_SB else find_board(image, target)
    if found is None:
        return _nothing(count, PointStatus.BOARD_NOT_FOUND, "")
    try:
        corners = _corners(image, found.corners_px, target, detector)
    except np.linalg.LinAlgError:  # corners that no camera could see
        return _nothing(count, PointStatus.CORNERS_INCONSISTENT, found.finder)
    if np.mean(~corners.consistent) > BAD_SHARE:
        return _nothing(count, PointStatus.CORNERS_INCONSISTENT, found.finder)
    circle = find_circle(image, corners.board, corners.blur_px, corners.contrast, target)
    points, covariance = np.full((count, 2), np.nan), np.full((count, 2, 2), np.nan)
    status = np.full(count, PointStatus.CORNERS_INCONSISTENT, STATUS_TYPE)
    good = np.append(corners.consistent, circle is not None)
    points[:-1], covariance[:-1], status[-1] = corners.points_px, corners.covariance_px2, PointStatus.CIRCLE_NOT_FOUND
    if circle is not None:
        points[-1], covariance[-1] = circle.centre_px, circle.covariance_px2
    status[good] = PointStatus.OK
    points[~good], covariance[~good] = np.nan, np.nan
    return Detection(points, covariance, status, found.finder, corners.blur_px)


def _corners(image: Grey, found_px: Array, target: Chessboard, detector: str) -> Corners:
    size = (image.shape[1], image.shape[0])
    fitted = refine_corners(image, first_map(found_px, size, target), chessboard_sites(target))
    if detector == Detector.EDGE_FIT or not np.any(fitted.consistent):
        return fitted
    placed = subpix(image, found_px) if detector == Detector.OPENCV_SUBPIX else found_px
    return check_placed(placed, fitted, grid(target.inner), size)


def _nothing(count: int, status: PointStatus, finder: str) -> Detection:
    statuses = np.full(count, status, STATUS_TYPE)
    return Detection(np.full((count, 2), np.nan), np.full((count, 2, 2), np.nan), statuses, finder, float("nan"))
