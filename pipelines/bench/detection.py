"""Detection against OpenCV's finders on the same pictures."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.recipe.model import Recipe
from pipelines.bench.cases import chosen_frames, image_of
from pipelines.bench.table import Figure, Row, compared
from pipelines.detection import detect_points
from pipelines.detection.finders import SECTOR_FLAGS, SUBPIX_STOP, SUBPIX_WINDOW
from pipelines.timing import Times, in_turn, total
from render.targets.chessboard import Chessboard

PART = "detection"
NAMES = ("findChessboardCorners, cornerSubPix", "findChessboardCornersSB, exhaustive, accuracy")
Grey = NDArray[np.uint8]


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """Rows for each camera against each finder, with how many pictures each finds."""
    sums: list[list[Times]] = []
    for camera, frames in chosen_frames(recipe, poses).items():
        images = [image_of(recipe, frame) for frame in frames]
        calls = [_ours, classic, sector_based]
        times = [in_turn(*(functools.partial(call, image, recipe.chessboard()) for call in calls)) for image in images]
        sums.append([total(list(column)) for column in zip(*times, strict=True)])
        yield from _rows(camera, sums[-1], len(images))
        ours, *theirs = (_found(call, images, recipe.chessboard()) for call in calls)
        told = " and ".join(map(str, theirs))
        yield Figure(
            PART, f"{camera}: boards found of {len(images)}", str(ours), f"found by {' and '.join(NAMES)}", told
        )
    every = [total(list(column)) for column in zip(*sums, strict=True)]
    yield from _rows("one picture of each camera", every, poses)


def classic(image: Grey, target: Chessboard) -> bool:
    """findChessboardCorners and cornerSubPix."""
    found, corners = cv2.findChessboardCorners(image, target.inner)
    if found:
        cv2.cornerSubPix(image, corners, SUBPIX_WINDOW, (-1, -1), SUBPIX_STOP)
    return found


def sector_based(image: Grey, target: Chessboard) -> bool:
    """findChessboardCornersSB as exact as it gets."""
    return cv2.findChessboardCornersSB(image, target.inner, flags=SECTOR_FLAGS)[0]


def _ours(image: Grey, target: Chessboard) -> bool:
    return bool(np.mean(detect_points(image, target).status == "ok") > 0.9)


def _found(call: Callable[[Grey, Chessboard], bool], images: list[Grey], target: Chessboard) -> int:
    return sum(call(image, target) for image in images)


def _rows(name: str, times: list[Times], count: int) -> Iterator[Row]:
    for other, that in zip(NAMES, times[1:], strict=True):
        yield compared(PART, f"{name}: corners and circle", times[0], other, that, count)
