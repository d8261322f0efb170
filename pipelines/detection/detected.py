"""What a detection says of one image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.encoding import PLAIN, Encoding
from pipelines.detection.statuses import STATUS_TYPE, PointStatus


@dataclass(frozen=True, slots=True)
class Detection:
    """Points of one image in the order of the target's `points`."""

    points_px: Array  # (n, 2), NaN where the status is not ok
    covariance_px2: Array  # (n, 2, 2) of each point, NaN likewise
    status: NDArray[np.str_]  # (n,) PointStatus values
    finder: str  # finder that saw the board, empty if none
    blur_px: float  # median blur of the edges, NaN if none
    encoding: Encoding = PLAIN  # of the picture; plain if light was found
    joint_factor: Array | None = None  # (n, 2, k) px: the covariance of points i and j is f[i] @ f[j].T; NaN where the
    # status is not ok. None where the points' errors are taken for independent


def nothing(count: int, status: PointStatus, finder: str) -> Detection:
    """All points with one status."""
    statuses = np.full(count, status, STATUS_TYPE)
    return Detection(np.full((count, 2), np.nan), np.full((count, 2, 2), np.nan), statuses, finder, float("nan"))
