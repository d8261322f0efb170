"""Detection of one image: board, corners, circles. Nothing but the image and the target's dimensions goes in."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.board_fit import fit_board
from pipelines.detection.board_map import grid
from pipelines.detection.board_size import is_of_another_size
from pipelines.detection.circle import find_circle
from pipelines.detection.circle_blur import motion_blur
from pipelines.detection.consistency import Corners, check_placed, misfit_squares, too_many_bad
from pipelines.detection.corner_sites import chessboard_sites
from pipelines.detection.corners import refine_corners
from pipelines.detection.finders import find_board, find_sector_based, subpix
from pipelines.detection.first_map import first_map
from pipelines.detection.grey_picture import Grey, grey_picture
from pipelines.detection.printed import check_seen, find_points, place_points
from pipelines.detection.seen_points import SeenPoints
from pipelines.detection.statuses import STATUS_TYPE, PointStatus
from pipelines.detection.time_limit import Check, TimeLimit, TooLateError
from pipelines.detection.tone_curve import decoded
from render.targets.chessboard import Chessboard
from render.targets.circle_grid import CircleGrid
from render.targets.kinds import AnyTarget
from render.targets.printed import PrintedBoard


class Detector(StrEnum):
    """How corners are placed once the board is found. The raised circle is fitted by us with each of them."""

    EDGE_FIT = "edge-fit"  # ours: two blurred edges, least squares
    BOARD_FIT = "board-fit"  # ours: those corners as points of one smooth map, with their joint covariance
    OPENCV_SUBPIX = "opencv-subpix"  # cv2.cornerSubPix with half window 5
    OPENCV_SB = "opencv-sb"  # cv2.findChessboardCornersSB, exhaustive and accurate; for chessboards


__all__ = ["Detection", "Detector", "PointStatus", "detect_points", "takes_target"]


OURS = Detector.EDGE_FIT, Detector.BOARD_FIT
LEAST_PICTURE_PX = 16  # of both sides: the least target, 3 x 3 corners or 4 x 3 discs, has 4 px to a square there


@dataclass(frozen=True, slots=True)
class Detection:
    """Points of one image in the order of the target's `points`."""

    points_px: Array  # (n, 2), NaN where the status is not ok
    covariance_px2: Array  # (n, 2, 2) of each point, NaN likewise
    status: NDArray[np.str_]  # (n,) PointStatus values
    finder: str  # finder that saw the board, empty if none
    blur_px: float  # median blur of the edges, NaN if none
    exponent: float = 1.0  # of the picture's tone curve, see `tone_curve`; 1 if light was found
    joint_factor: Array | None = None  # (n, 2, k) px: the covariance of points i and j is f[i] @ f[j].T; NaN where the
    # status is not ok. None where the points' errors are taken for independent


def detect_points(
    image: NDArray[np.generic], target: AnyTarget, detector: str = Detector.EDGE_FIT, seconds: float = math.inf
) -> Detection:
    """The target's points in a picture (height, width) of grey or (height, width, 3 or 4) of colour.

    The picture has 8 or 16 bits or floating point; see `grey_picture`.

    seconds: of processor time, after which all points are `too_late`; see `pipelines.detection.time_limit`.

    Raises:
        ValueError: a picture of another kind, an unknown detector, or one that does not take the target.
    """
    if detector not in list(Detector):
        raise ValueError(f"unknown detector {detector!r}; choose one of {', '.join(Detector)}")
    if not takes_target(detector, target):
        raise ValueError(f"detector {str(detector)!r} does not find the target {target.pattern!r}; choose another")
    check_time = TimeLimit(seconds).check
    grey = grey_picture(image)
    if min(grey.shape) < LEAST_PICTURE_PX:
        return _nothing(len(target.points), PointStatus.BOARD_NOT_FOUND, "")
    try:
        if isinstance(target, Chessboard):
            return _detect_chessboard(grey, target, detector, check_time)
        return _detect_printed(grey, target, detector, check_time)
    except TooLateError:
        return _nothing(len(target.points), PointStatus.TOO_LATE, "")


def takes_target(detector: str, target: AnyTarget) -> bool:
    """Whether a detector can find a kind of target."""
    if detector == Detector.BOARD_FIT:
        return not isinstance(target, CircleGrid)
    return detector != Detector.OPENCV_SB or isinstance(target, Chessboard)


def _detect_printed(image: Grey, target: PrintedBoard, detector: str, check_time: Check) -> Detection:
    count = len(target.points)
    seen = find_points(image, target, check_time)
    if isinstance(seen, PointStatus):
        return _nothing(count, seen, "")
    try:
        placed = place_points(image, seen, target, check_time)
    except np.linalg.LinAlgError:  # points that no camera could see
        return _nothing(count, PointStatus.CORNERS_INCONSISTENT, seen.finder)
    if detector == Detector.OPENCV_SUBPIX and np.any(placed.consistent):
        placed = check_seen(image, seen, placed, target)
    good = placed.consistent
    if too_many_bad(good[seen.ids]):
        return _nothing(count, PointStatus.CORNERS_INCONSISTENT, seen.finder)
    status = np.where(good, PointStatus.OK, PointStatus.POINT_NOT_FOUND).astype(STATUS_TYPE)
    points = np.where(good[:, None], placed.points_px, np.nan)
    covariance = np.where(good[:, None, None], placed.covariance_px2, np.nan)
    found = Detection(points, covariance, status, seen.finder, placed.blur_px)
    if detector != Detector.BOARD_FIT:
        return found
    return _smoothed(found, placed, np.arange(count), target.pattern_points / target.unit_mm)


def _detect_chessboard(image: Grey, target: Chessboard, detector: str, check_time: Check) -> Detection:
    """Corners and circle."""
    count = len(target.points)
    find = find_sector_based if detector == Detector.OPENCV_SB else find_board
    seen = find(image, target, check_time)
    if isinstance(seen, PointStatus):
        return _nothing(count, seen, "")
    try:
        corners = _corners(image, seen, target, detector, check_time)
    except np.linalg.LinAlgError:  # corners that no camera could see
        return _nothing(count, PointStatus.CORNERS_INCONSISTENT, seen.finder)
    if too_many_bad(corners.consistent[: len(seen.ids)]):
        return _nothing(count, PointStatus.CORNERS_INCONSISTENT, seen.finder)
    ids = np.append(seen.ids, _unseen(seen, target)).astype(np.int64)[: len(corners.consistent)]
    at = grid(target.inner)[ids]
    misfit = misfit_squares(corners, at)
    check_time()
    light = decoded(image, corners.exponent)
    if is_of_another_size(light, corners, at, target):
        return _nothing(count, PointStatus.OTHER_BOARD, seen.finder)
    motion = motion_blur(light, corners.board, chessboard_sites(target).chosen(ids[corners.consistent]))
    circle = find_circle(light, corners, at, target, misfit, motion)
    points, covariance = np.full((count, 2), np.nan), np.full((count, 2, 2), np.nan)
    status = np.full(count, PointStatus.POINT_NOT_FOUND, STATUS_TYPE)
    good = ids[corners.consistent]
    status[seen.ids], status[good] = PointStatus.CORNERS_INCONSISTENT, PointStatus.OK
    points[good], covariance[good] = (part[corners.consistent] for part in (corners.points_px, corners.covariance_px2))
    status[-1] = PointStatus.CIRCLE_NOT_FOUND
    if circle is not None:
        points[-1], status[-1] = circle.centre_px, PointStatus.OK
        covariance[-1] = circle.covariance_px2
    found = Detection(points, covariance, status, seen.finder, corners.blur_px, corners.exponent)
    return _smoothed(found, corners, ids, at) if detector == Detector.BOARD_FIT else found


def _smoothed(found: Detection, corners: Corners, ids: NDArray[np.int64], at: Array) -> Detection:
    """A detection whose corners are points of one smooth map; another point, as the circle, keeps an error of its own.

    ids: (n,) places of the corners in the detection. at: (n, 2) squares.
    """
    is_ok = found.status == PointStatus.OK
    if not np.any(corners.consistent):
        return found
    try:
        fit = fit_board(corners, at)
    except np.linalg.LinAlgError:  # covariances without an inverse
        return _nothing(len(is_ok), PointStatus.CORNERS_INCONSISTENT, found.finder)
    good = ids[corners.consistent]
    alone = np.setdiff1d(np.flatnonzero(is_ok), good)
    points, rank = found.points_px.copy(), fit.factor.shape[2]
    factor = np.zeros((len(points), 2, rank + 2 * len(alone)))
    points[good], factor[good, :, :rank], factor[~is_ok] = fit.points_px, fit.factor, np.nan
    for i, point in enumerate(alone):
        factor[point, :, rank + 2 * i : rank + 2 * i + 2] = np.linalg.cholesky(found.covariance_px2[point])
    return replace(found, points_px=points, covariance_px2=factor @ factor.transpose(0, 2, 1), joint_factor=factor)


def _corners(image: Grey, seen: SeenPoints, target: Chessboard, detector: str, check_time: Check) -> Corners:
    """The corners that were seen, in the order of their ids, placed by our fit or by OpenCV.

    By ours, those that were not seen follow.
    """
    size = (image.shape[1], image.shape[0])
    every = chessboard_sites(target)
    sites = every.chosen(seen.ids)
    unseen = every.chosen(_unseen(seen, target)) if detector in OURS else None
    fitted = refine_corners(image, first_map(seen, size, target), sites, unseen, check_time)
    if detector in OURS or not np.any(fitted.consistent):
        return fitted
    placed = subpix(image, seen.points_px) if detector == Detector.OPENCV_SUBPIX else seen.points_px
    return check_placed(placed, fitted, sites.at, size)


def _unseen(seen: SeenPoints, target: Chessboard) -> NDArray[np.int64]:
    """Ids of the corners that were not seen."""
    return np.setdiff1d(np.arange(target.circle_index), seen.ids).astype(np.int64)


def _nothing(count: int, status: PointStatus, finder: str) -> Detection:
    statuses = np.full(count, status, STATUS_TYPE)
    return Detection(np.full((count, 2), np.nan), np.full((count, 2, 2), np.nan), statuses, finder, float("nan"))
