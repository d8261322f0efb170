"""Large circles are read in means of several pixels: a sharp rim of thousands of pixels takes no longer.

A mean is blurred by the area that it is taken over; what is known of the picture's blur is carried over with that.
"""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from pipelines.detection.circle_blur import Blur, still
from pipelines.detection.circle_patch import Picture
from pipelines.detection.consistency import Corners

LARGE_RADIUS_PX = 30.0  # a larger circle is read in means of pixels that leave its edges this blur:
LEAST_BLUR_PX = 0.7  # below it the fine grid would sample them badly
MOST_RADIUS_PX = 150.0  # a larger one is read in means whatever it costs: 0.03 px instead of 0.01, in bounded time
MOVED_RADIUS_PX, LONG_STREAK_PX = 60.0, 12.0  # likewise where the picture moved: a fit costs four times as much


def pixels_to_one(radius_px: float, blur_px: float, motion: Blur | None) -> int:
    """Along each side: how many pixels' mean is read in the place of one. blur_px: of edges that stood still."""
    harmless = min(math.ceil(radius_px / LARGE_RADIUS_PX), max(1, int((motion or still(blur_px)).px / LEAST_BLUR_PX)))
    if motion is None:
        return max(harmless, math.ceil(radius_px / MOST_RADIUS_PX))
    return max(harmless, math.ceil(max(radius_px / MOVED_RADIUS_PX, np.linalg.norm(motion.streak) / LONG_STREAK_PX)))


def picture_of_means(image: Picture, by: int) -> NDArray[np.float32]:
    """The means of `by` x `by` pixels; what is left at the right and below is cut off."""
    height, width = (side // by for side in image.shape)
    whole = image[: height * by, : width * by].astype(np.float32)
    return np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA), np.float32)


def corners_in_means(corners: Corners, by: int) -> Corners:
    """What is known of a picture's corners, in the picture of its means."""
    along_x, along_y = corners.widths_beyond_px
    return replace(
        corners,
        points_px=(corners.points_px + 0.5) / by - 0.5,
        covariance_px2=corners.covariance_px2 / by**2,
        blur_px=still(corners.blur_px).in_means(by).px,
        board=corners.board.reduced(by),
        noise=corners.noise / by**2,
        widths_beyond_px=(along_x / by, along_y / by),
        rows_px2=corners.rows_px2 / by**2,
    )
