"""The part of a picture that has strong edges: where a board, if there is one, may be looked for first."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from render.targets.image_region import Region

DECIMATION = 4  # of the picture in which texture is looked for
REGION_MARGIN_PX = 16
LEAST_GRADIENT = 16  # grey values between neighbours that count as texture


def textured_region(image: NDArray[np.uint8]) -> Region:
    """The pixels with strong edges and a margin; the whole image if there are none."""
    small = cv2.resize(image, None, fx=1.0 / DECIMATION, fy=1.0 / DECIMATION, interpolation=cv2.INTER_LINEAR)
    gradient = cv2.morphologyEx(small, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    strong = gradient > max(LEAST_GRADIENT, int(gradient.max()) // 3)
    columns, rows = np.flatnonzero(strong.any(axis=0)), np.flatnonzero(strong.any(axis=1))
    if not len(columns):
        return Region.whole(image.shape[1], image.shape[0])
    x0, y0 = (max(0, DECIMATION * int(line[0]) - REGION_MARGIN_PX) for line in (columns, rows))
    x1, y1 = (
        min(size, DECIMATION * (int(line[-1]) + 1) + REGION_MARGIN_PX)
        for line, size in ((columns, image.shape[1]), (rows, image.shape[0]))
    )
    return Region.between((x0, y0), (x1, y1))
