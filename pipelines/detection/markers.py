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
from render.targets.markers import TAG_FAMILY

ENLARGEMENT, MOST_PIXELS = 2.0, 8e6  # modules of two or three pixels are read in an enlarged picture only
UNREDUCED_PIXELS = 5e6  # a larger picture is reduced to so many: textures would be read as markers for half a minute
LEAST_SIDE = 0.0075  # of a marker, in the picture's longer side: a quarter of OpenCV's least perimeter
MOST_PIECES = 1000  # of that size, black or white, in a picture in which OpenCV looks at once
TILES = 4  # along each side of a picture with more
OVERLAP_PX = 80  # of tiles: a marker that is no larger is whole in one
THRESHOLD_AROUND_PX, THRESHOLD_GREY, TILE_THRESHOLD_PX = 23, 7.0, 13  # OpenCV's for markers
UPRIGHT = (2, 3, 0, 1)  # corners of Kalibr's tag in the order in which OpenCV, for whom it stands on its head, has them


def find_charuco(image: Grey, target: Charuco) -> SeenPoints | None:
    """Inner corners of a ChArUco board, numbered by the markers beside them; None if too few markers are read."""
    large, scale, offset = _enlarged(image)
    detector = _charuco_detector(target)
    if is_crowded(large):
        dictionary = _own_markers(f"DICT_{target.dictionary}", target.marker_count)
        read, numbers = read_in_tiles(large, dictionary, 1)
        if not read:
            return None
        corners, ids, _, _ = detector.detectBoard(large, markerCorners=read, markerIds=numbers)
    else:
        corners, ids, _, _ = detector.detectBoard(large)
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
    dictionary = _own_markers(f"DICT_{TAG_FAMILY}", target.columns * target.rows)
    if is_crowded(large):
        corners, tags = read_in_tiles(large, dictionary, BORDER_MODULES)
    else:
        corners, tags, _ = cv2.aruco.ArucoDetector(dictionary, _parameters(BORDER_MODULES)).detectMarkers(large)
    if tags is None or not len(tags):
        return None
    found = {int(tag): np.asarray(at, np.float64).reshape(4, 2) for tag, at in zip(tags.ravel(), corners, strict=True)}
    ids = np.array([target.corner_index(tag, corner) for tag in found for corner in UPRIGHT])
    return SeenPoints(ids, _in_picture(np.concatenate(list(found.values())), scale, offset), "aprilgrid")


@functools.lru_cache(maxsize=4)
def _charuco_detector(target: Charuco) -> cv2.aruco.CharucoDetector:
    dictionary = _own_markers(f"DICT_{target.dictionary}", target.marker_count)
    board = cv2.aruco.CharucoBoard((target.columns, target.rows), target.square_mm, target.marker_mm, dictionary)
    return cv2.aruco.CharucoDetector(board)


@functools.lru_cache(maxsize=4)
def _own_markers(name: str, count: int) -> cv2.aruco.Dictionary:
    """The first markers of a dictionary, which are the board's: each piece of the picture is compared with all."""
    whole = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
    return cv2.aruco.Dictionary(whole.bytesList[:count].copy(), whole.markerSize, whole.maxCorrectionBits)


def _parameters(border: int) -> cv2.aruco.DetectorParameters:
    """border: of a marker, modules."""
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = border
    return parameters


def is_crowded(image: Grey) -> bool:
    """Whether so many pieces may be markers that OpenCV, which compares each with each, would take many seconds."""
    mask = cv2.adaptiveThreshold(
        image, 255, cv2.ADAPTIVE_THRESH_MEAN_C, cv2.THRESH_BINARY_INV, THRESHOLD_AROUND_PX, THRESHOLD_GREY
    )
    least = LEAST_SIDE * max(image.shape)
    count = 0
    for pieces in (mask, 255 - mask):
        stats = cv2.connectedComponentsWithStats(pieces, connectivity=4)[2][1:]
        count += int(np.sum(np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) >= least))
    return count > MOST_PIECES


def read_in_tiles(image: Grey, dictionary: cv2.aruco.Dictionary, border: int) -> tuple[list[Array], NDArray[np.int32]]:
    """Corners (1, 4, 2) px of the markers that are read in overlapping tiles of a picture, and their numbers.

    border: of a marker, modules. One threshold is tried instead of OpenCV's three.
    """
    found: dict[int, Array] = {}
    tall, wide = (size // TILES for size in image.shape)
    parameters = _parameters(border)
    parameters.adaptiveThreshWinSizeMin = parameters.adaptiveThreshWinSizeMax = TILE_THRESHOLD_PX
    rate = parameters.minMarkerPerimeterRate
    for row in range(TILES):
        for column in range(TILES):
            top, left = max(row * tall - OVERLAP_PX, 0), max(column * wide - OVERLAP_PX, 0)
            tile = image[top : (row + 1) * tall + OVERLAP_PX, left : (column + 1) * wide + OVERLAP_PX]
            parameters.minMarkerPerimeterRate = rate * max(image.shape) / max(tile.shape)  # the same size
            detector = cv2.aruco.ArucoDetector(dictionary, parameters)
            corners, numbers, _ = detector.detectMarkers(np.ascontiguousarray(tile))
            if numbers is not None:
                for number, at in zip(numbers.ravel(), corners, strict=True):
                    found.setdefault(int(number), np.asarray(at + np.array([left, top]), np.float32))
    return list(found.values()), np.array(list(found), np.int32).reshape(-1, 1)


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
