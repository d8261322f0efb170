"""Where the time of one frame goes, step by step, each beside the least that the step has to do.

In processor time, of all threads together: other programs do not change it.
"""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

import eposit
from datasets.plan import Frame
from datasets.recipe.model import Recipe
from datasets.store.images import decode_png, encode_png
from datasets.store.linear_images import write_linear
from pipelines.bench.cases import chosen_frames, image_of, linear_of
from pipelines.bench.primary_rays import NAME, primary_rays
from pipelines.bench.table import Row, compared
from pipelines.detection import detect_points
from pipelines.detection.board_map import grid
from pipelines.detection.circle import find_circle
from pipelines.detection.corner_sites import chessboard_sites
from pipelines.detection.corners import refine_corners
from pipelines.detection.finders import SUBPIX_STOP, SUBPIX_WINDOW, find_board
from pipelines.detection.first_map import first_map
from pipelines.detection.statuses import PointStatus
from pipelines.detection.textured_region import textured_region
from pipelines.timing import Times, in_turn

PART = "profile"
CLASSIC_FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
Call = Callable[[], Any]


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """Rows for the first pose through the recipe's last camera; `poses` does not matter."""
    frame = chosen_frames(recipe, 1)[recipe.cameras[-1].name][0]
    with tempfile.TemporaryDirectory() as folder:
        for name, call, floor_name, floor in _steps(recipe, frame, Path(folder)):
            own, that = (Times(times.cpu, times.cpu) for times in in_turn(call, floor, repeats=7))
            yield compared(PART, f"{frame.camera.name}: {name}, processor time", own, floor_name, that)


def _steps(recipe: Recipe, frame: Frame, folder: Path) -> Iterator[tuple[str, Call, str, Call]]:
    camera, target = frame.camera.true_camera(), recipe.chessboard()
    linear = linear_of(recipe, frame)
    picture, image = linear.full(camera), image_of(recipe, frame, linear)
    data = encode_png(image)
    copied = functools.partial(np.copy, image)
    raw = functools.partial((folder / "raw").write_bytes, linear.radiance.tobytes())
    exr = functools.partial(write_linear, linear, camera, folder / "linear.exr")
    yield "render", functools.partial(linear_of, recipe, frame), NAME, functools.partial(primary_rays, recipe, frame)
    yield "write the linear image as EXR", exr, "write its bytes", raw
    blur = functools.partial(cv2.GaussianBlur, picture, (9, 9), 0.7)
    yield "develop", functools.partial(image_of, recipe, frame, linear), "one gaussian blur of the picture", blur
    yield "encode PNG", functools.partial(encode_png, image), "copy the picture", copied
    yield "decode PNG", functools.partial(decode_png, data), "copy the picture", copied
    yield from _detection(image, target)
    found = detect_points(image, target)
    ok = found.status == "ok"
    solve = functools.partial(
        eposit.solve, target.points[ok], found.points_px[ok], camera, sigma_px=found.covariance_px2[ok]
    )
    project = functools.partial(camera.project, frame.cam_from_obj.apply(target.points))
    yield "solve, all points", solve, "project the points once", project


def _detection(image: Any, target: Any) -> Iterator[tuple[str, Call, str, Call]]:
    part = image[textured_region(image).pixels]
    finder = functools.partial(cv2.findChessboardCorners, part, target.inner, flags=CLASSIC_FLAGS)
    yield "find the board", functools.partial(find_board, image, target), "OpenCV's finder on the textured part", finder
    board, sites = find_board(image, target), chessboard_sites(target)
    if isinstance(board, PointStatus):
        return
    rough = functools.partial(first_map, board, (image.shape[1], image.shape[0]), target)
    start = board.points_px.astype(np.float32).reshape(-1, 1, 2)
    yield "map from board to image", rough, "its slopes once", functools.partial(rough().slopes, grid(target.inner))
    subpix = lambda: cv2.cornerSubPix(image, start.copy(), SUBPIX_WINDOW, (-1, -1), SUBPIX_STOP)  # noqa: E731
    yield "corners", functools.partial(refine_corners, image, rough(), sites), "cv2.cornerSubPix", subpix
    corners = refine_corners(image, rough(), sites)
    circle = functools.partial(find_circle, image, corners, sites.at, target)
    yield "circle", circle, "cv2.cornerSubPix", subpix
