"""Detection of one image: board, corners, circles. Nothing but the image and the target's dimensions goes in.

What detects is imported with the first picture: a command that only names a detector starts a second sooner.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pipelines.detection.detected import Detection, nothing
from pipelines.detection.detectors import Detector, takes_target
from pipelines.detection.grey_picture import grey_picture
from pipelines.detection.statuses import PointStatus
from pipelines.detection.time_limit import TimeLimit, TooLateError
from render.targets.chessboard import Chessboard
from render.targets.kinds import AnyTarget

__all__ = ["Detection", "Detector", "PointStatus", "detect_points", "takes_target"]

LEAST_PICTURE_PX = 16  # of both sides: the least target, 3 x 3 corners or 4 x 3 discs, has 4 px to a square there


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
    from pipelines.detection.boards import detect_chessboard, detect_printed

    check_time = TimeLimit(seconds).check
    grey = grey_picture(image)
    if min(grey.shape) < LEAST_PICTURE_PX:
        return nothing(len(target.points), PointStatus.BOARD_NOT_FOUND, "")
    try:
        if isinstance(target, Chessboard):
            return detect_chessboard(grey, target, detector, check_time)
        return detect_printed(grey, target, detector, check_time)
    except TooLateError:
        return nothing(len(target.points), PointStatus.TOO_LATE, "")
