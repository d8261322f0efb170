"""Single pixels of a picture that are white or black whatever falls on them, as worn sensors have them."""

from __future__ import annotations

import cv2
import numpy as np

from eposit.arrays import Array
from pipelines.detection.finders import Grey
from pipelines.spread import NORMAL_MAD

LEAST_EXCESS = 20.0  # grey values that a pixel must lie beyond all its neighbours; a blurred board has none such
EXCESS_NOISES = 8.0  # and so many deviations of the noise between neighbours
ROWS = 4  # of so many rows one tells the noise
RING = np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], np.uint8)


def without_hot_pixels(image: Grey, points_px: Array, beyond_px: float) -> Grey:
    """The picture with the median of 3 x 3 where a pixel lies far above or below all its eight neighbours.

    Only the part around points (n, 2) px counts, up to `beyond_px` of them; the picture itself where it has no such
    pixel. One of them would move a corner by 0.03 px.
    """
    low = np.maximum(np.floor(points_px.min(axis=0) - beyond_px), 0.0).astype(int)
    high = np.maximum(np.ceil(points_px.max(axis=0) + beyond_px), 0.0).astype(int) + 1
    inside = slice(low[1], high[1]), slice(low[0], high[0])
    part = np.ascontiguousarray(image[inside])
    if min(part.shape) < len(RING):
        return image
    above, below = cv2.subtract(part, cv2.dilate(part, RING)), cv2.subtract(cv2.erode(part, RING), part)
    steps = np.abs(np.diff(part[::ROWS].astype(np.int16), axis=1))
    noise = NORMAL_MAD * float(np.median(steps)) / np.sqrt(2.0)
    hot = np.maximum(above, below) > LEAST_EXCESS + EXCESS_NOISES * noise
    if not np.any(hot):
        return image
    mended = image.copy()
    mended[inside] = np.where(hot, cv2.medianBlur(part, len(RING)), part)
    return mended
