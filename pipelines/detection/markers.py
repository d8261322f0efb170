"""Boards with markers in an image: OpenCV reads the markers' numbers, which say where on the board they are."""

from __future__ import annotations

import functools

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.grey_picture import Grey
from pipelines.detection.seen_points import SeenPoints
from pipelines.detection.textured_region import textured_region
from render.targets.aprilgrid import BORDER_MODULES, AprilGrid
from render.targets.charuco import Charuco

ENLARGEMENT, MOST_PIXELS = 2.0, 8e6  # modules of two or three pixels are read in an enlarged picture only
UNREDUCED_PIXELS = (
    5e6  # a larger picture is reduced to so many: its textures would be read as markers for half a minute
)
UPRIGHT = (2, 3, 0, 1)  # corners of Kalibr's tag in the order in which OpenCV, for whom it stands on its head, has them


def find_charuco(image: Grey, target: Charuco) -> SeenPoints | None:
    """Inner corners of a ChArUco board, numbered by the markers beside them; None if too few markers are read."""
    large, scale, offset = _enlarged(image)
    corners, ids, _, _ = _charuco_detector(target).detectBoard(large)
    if ids is None or not len(ids):
        return None
    return SeenPoints(
        ids.ravel().astype(np.int64),
        _in_picture(np.asarray(corners, np.float64).reshape(-1, 2), scale, offset),
        "charuco",
    )


def find_aprilgrid(image: Grey, target: AprilGrid) -> SeenPoints | None:
    """Corners of the tags that are read; None if none is."""
    large, scale, offset = _enlarged(image)
    corners, tags, _ = _tag_detector().detectMarkers(large)
    if tags is None or not len(tags):
        return None
    found = {int(tag): np.asarray(at, np.float64).reshape(4, 2) for tag, at in zip(tags.ravel(), corners, strict=True)}
    own = {tag: at for tag, at in found.items() if tag < target.columns * target.rows}
    if not own:
        return None
    ids = np.array([target.corner_index(tag, corner) for tag in own for corner in UPRIGHT])
    return SeenPoints(ids, _in_picture(np.concatenate(list(own.values())), scale, offset), "aprilgrid")


@functools.lru_cache(maxsize=4)
def _charuco_detector(target: Charuco) -> cv2.aruco.CharucoDetector:
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{target.dictionary}"))
    board = cv2.aruco.CharucoBoard((target.columns, target.rows), target.square_mm, target.marker_mm, dictionary)
    return cv2.aruco.CharucoDetector(board)


@functools.cache
def _tag_detector() -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = BORDER_MODULES
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11), parameters)


def _enlarged(image: Grey) -> tuple[NDArray[np.uint8], float, Array]:
    """The textured region enlarged or reduced, by how much, and its first pixel."""
    region = textured_region(image)
    part = image[region.pixels]
    scale = max(1.0, min(ENLARGEMENT, float(np.sqrt(MOST_PIXELS / part.size))))
    if part.size > UNREDUCED_PIXELS:
        scale = float(np.sqrt(UNREDUCED_PIXELS / part.size))
    kind = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
    large = cv2.resize(part, None, fx=scale, fy=scale, interpolation=kind)
    return large.astype(np.uint8), scale, np.array([region.x, region.y], np.float64)


def _in_picture(points: Array, scale: float, offset: Array) -> Array:
    """Pixel centres at integers: the centre of pixel 0 lies (scale - 1) / 2 into the enlarged picture."""
    return (points - (scale - 1.0) / 2.0) / scale + offset
