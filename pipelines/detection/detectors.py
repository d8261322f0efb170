"""Which detectors there are, and what they find."""

from __future__ import annotations

from enum import StrEnum

from render.targets.chessboard import Chessboard
from render.targets.circle_grid import CircleGrid
from render.targets.kinds import AnyTarget


class Detector(StrEnum):
    """How corners are placed once the board is found. The raised circle is fitted by us with each of them."""

    EDGE_FIT = "edge-fit"  # ours: two blurred edges, least squares
    BOARD_FIT = "board-fit"  # ours: those corners as points of one smooth map, with their joint covariance
    OPENCV_SUBPIX = "opencv-subpix"  # cv2.cornerSubPix with half window 5
    OPENCV_SB = "opencv-sb"  # cv2.findChessboardCornersSB, exhaustive and accurate; for chessboards


OURS = Detector.EDGE_FIT, Detector.BOARD_FIT


def takes_target(detector: str, target: AnyTarget) -> bool:
    """Whether a detector can find a kind of target."""
    if detector == Detector.BOARD_FIT:
        return not isinstance(target, CircleGrid)
    return detector != Detector.OPENCV_SB or isinstance(target, Chessboard)
