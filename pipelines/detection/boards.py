"""How the points of each kind of target are found and placed in a picture."""

from __future__ import annotations

from dataclasses import replace

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
from pipelines.detection.detected import Detection, nothing
from pipelines.detection.detectors import OURS, Detector
from pipelines.detection.finders import find_board, find_sector_based, subpix
from pipelines.detection.first_map import first_map
from pipelines.detection.grey_picture import Grey
from pipelines.detection.printed import check_seen, find_points, place_points
from pipelines.detection.seen_points import SeenPoints
from pipelines.detection.statuses import STATUS_TYPE, PointStatus
from pipelines.detection.time_limit import Check
from render.targets.chessboard import Chessboard
from render.targets.plain_chessboard import PlainChessboard
from render.targets.printed import PrintedBoard


def detect_printed(image: Grey, target: PrintedBoard, detector: str, check_time: Check) -> Detection:
    """The points of a target whose pattern tells which is which, or of a grid of discs."""
    count = len(target.points)
    seen = find_points(image, target, check_time)
    if isinstance(seen, PointStatus):
        return nothing(count, seen, "")
    try:
        placed = place_points(image, seen, target, check_time)
    except np.linalg.LinAlgError:  # points that no camera could see
        return nothing(count, PointStatus.CORNERS_INCONSISTENT, seen.finder)
    if detector == Detector.OPENCV_SUBPIX and np.any(placed.consistent):
        placed = check_seen(image, seen, placed, target)
    good = placed.consistent
    if too_many_bad(good[seen.ids]):
        return nothing(count, PointStatus.CORNERS_INCONSISTENT, seen.finder)
    if isinstance(target, PlainChessboard):
        at = target.pattern_points / target.unit_mm
        if is_of_another_size(np.asarray(image, np.float32), placed, at, target, seen.exchanged):
            return nothing(count, PointStatus.OTHER_BOARD, seen.finder)
    status = np.where(good, PointStatus.OK, PointStatus.POINT_NOT_FOUND).astype(STATUS_TYPE)
    points = np.where(good[:, None], placed.points_px, np.nan)
    covariance = np.where(good[:, None, None], placed.covariance_px2, np.nan)
    found = Detection(points, covariance, status, seen.finder, placed.blur_px)
    if detector != Detector.BOARD_FIT:
        return found
    return _smoothed(found, placed, np.arange(count), target.pattern_points / target.unit_mm)


def detect_chessboard(image: Grey, target: Chessboard, detector: str, check_time: Check) -> Detection:
    """Corners and circle."""
    count = len(target.points)
    find = find_sector_based if detector == Detector.OPENCV_SB else find_board
    seen = find(image, target, check_time)
    if isinstance(seen, PointStatus):
        return nothing(count, seen, "")
    try:
        corners = _corners(image, seen, target, detector, check_time)
    except np.linalg.LinAlgError:  # corners that no camera could see
        return nothing(count, PointStatus.CORNERS_INCONSISTENT, seen.finder)
    if too_many_bad(corners.consistent[: len(seen.ids)]):
        return nothing(count, PointStatus.CORNERS_INCONSISTENT, seen.finder)
    ids = np.append(seen.ids, _unseen(seen, target)).astype(np.int64)[: len(corners.consistent)]
    at = grid(target.inner)[ids]
    misfit = misfit_squares(corners, at)
    check_time()
    light = corners.encoding.light(image, corners.points_px[corners.consistent])
    if is_of_another_size(light, corners, at, target):
        return nothing(count, PointStatus.OTHER_BOARD, seen.finder)
    motion = motion_blur(light, corners.board, chessboard_sites(target).chosen(ids[corners.consistent]))
    circle = find_circle(corners.encoding.with_clipped(light, image), corners, at, target, misfit, motion)
    points, covariance = np.full((count, 2), np.nan), np.full((count, 2, 2), np.nan)
    status = np.full(count, PointStatus.POINT_NOT_FOUND, STATUS_TYPE)
    good = ids[corners.consistent]
    status[seen.ids], status[good] = PointStatus.CORNERS_INCONSISTENT, PointStatus.OK
    points[good], covariance[good] = (part[corners.consistent] for part in (corners.points_px, corners.covariance_px2))
    status[-1] = PointStatus.CIRCLE_NOT_FOUND
    if circle is not None:
        points[-1], status[-1] = circle.centre_px, PointStatus.OK
        covariance[-1] = circle.covariance_px2
    found = Detection(points, covariance, status, seen.finder, corners.blur_px, corners.encoding)
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
        return nothing(len(is_ok), PointStatus.CORNERS_INCONSISTENT, found.finder)
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
