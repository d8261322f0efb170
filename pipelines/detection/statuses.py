"""Outcomes of detection, point by point."""

from __future__ import annotations

from enum import StrEnum

import numpy as np


class PointStatus(StrEnum):
    """Outcome for one point."""

    OK = "ok"
    BOARD_NOT_FOUND = "board_not_found"  # no finder saw the target, or enough of it
    OTHER_BOARD = "other_board"  # squares are seen, but of a board of another size or with colours exchanged
    MIRRORED = "mirrored"  # the circle lies where it lies in a mirrored picture of the board
    ORIENTATION_AMBIGUOUS = "orientation_ambiguous"  # corners are seen, but not which of the board's they are
    CORNERS_INCONSISTENT = "corners_inconsistent"  # the corner, or too many of the board's, disagree with the others
    CIRCLE_NOT_FOUND = "circle_not_found"  # no dark disc where the board puts the circle
    TOO_LATE = "too_late"  # the picture's detection has taken longer than it may; no bound on its work ended it
    POINT_NOT_FOUND = "point_not_found"  # of a board that was seen: outside the picture, covered, or unlike it


STATUS_TYPE = np.dtype(f"<U{max(len(status) for status in PointStatus)}")
