"""Detection of one image: board, corners, circle. Nothing but the image and the target's dimensions goes in."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.board import Grey, find_board
from pipelines.circle import find_circle, locate_circle
from pipelines.corners import BAD_SHARE, refine_corners
from pipelines.surface import BoardMap, grid
from render.target import Target

CIRCLE_CLEARANCE = 1.3  # squares from the circle's foot within which the first, rough corners are not trusted


class PointStatus(StrEnum):
    """Outcome for one point."""

    OK = "ok"
    BOARD_NOT_FOUND = "board_not_found"  # no finder saw a complete board
    CORNERS_INCONSISTENT = "corners_inconsistent"  # the corner, or too many of the board's, disagree with the others
    CIRCLE_NOT_FOUND = "circle_not_found"  # no contour of the right shape where the board puts the circle


@dataclass(frozen=True, slots=True)
class Detection:
    """Points of one image in the order of `Target.points`."""

    points_px: Array  # (n, 2), NaN where the status is not ok
    status: NDArray[np.str_]  # (n,) PointStatus values
    finder: str  # finder that saw the board, empty if none
    blur_px: float  # median blur of the edges, NaN if none


def detect_points(image: Grey, target: Target) -> Detection:
    """Corners and circle of the target in an 8-bit image (height, width).

    Raises:
        ValueError: not a two-dimensional 8-bit image.
    """
    if image.ndim != 2 or image.dtype != np.uint8:
        raise ValueError(f"image has shape {image.shape} and type {image.dtype}; give 8-bit grey, (height, width)")
    count = len(target.points)
    found = find_board(image, target)
    if found is None:
        return _nothing(count, PointStatus.BOARD_NOT_FOUND, "")
    foot = target.circle_centre[:2] / target.square_mm
    clear = np.linalg.norm(grid(target.inner) - foot, axis=1) > CIRCLE_CLEARANCE
    rough = BoardMap.fit(found.corners_px, target.inner, clear)
    corners = refine_corners(image, rough, locate_circle(image, rough, target), target)
    if np.mean(~corners.consistent) > BAD_SHARE:
        return _nothing(count, PointStatus.CORNERS_INCONSISTENT, found.finder)
    circle = find_circle(image, BoardMap.fit(corners.points_px, target.inner, corners.consistent), target)
    points = np.vstack((corners.points_px, circle.centre_px if circle else np.full(2, np.nan)))
    status = np.array([PointStatus.OK] * count, dtype="<U24")
    status[:-1][~corners.consistent] = PointStatus.CORNERS_INCONSISTENT
    status[-1] = PointStatus.OK if circle else PointStatus.CIRCLE_NOT_FOUND
    points[status != PointStatus.OK] = np.nan
    return Detection(points, status, found.finder, corners.blur_px)


def _nothing(count: int, status: PointStatus, finder: str) -> Detection:
    return Detection(np.full((count, 2), np.nan), np.array([status] * count, dtype="<U24"), finder, float("nan"))
