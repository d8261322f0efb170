"""The chessboard in an image, without any hint of where it is: found by OpenCV, put in the board's own order.

Finders, in order: classic on the textured region (a few ms), on the whole image, on the region enlarged; sector-based.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region
from render.targets.plain_chessboard import PlainChessboard

Grey = NDArray[np.uint8]

ENLARGEMENT = 3.0  # the classic finder needs squares of about 10 px; tilted ones are smaller
LEAST_ENLARGEMENT, MOST_PIXELS = 1.3, 8e6  # of an enlarged region; larger ones take seconds
CLASSIC_FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
SECTOR_FLAGS = cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_EXHAUSTIVE
SUBPIX_WINDOW = (5, 5)
SUBPIX_STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-3)
UNCHECKED_PIXELS = 6e5  # up to which a finder may try everything
DECIMATION = 4  # of the picture in which texture is looked for
REGION_MARGIN_PX = 16
LEAST_GRADIENT = 16  # grey values between neighbours that count as texture


@dataclass(frozen=True, slots=True)
class Found:
    """A complete board in an image, to about a pixel."""

    corners_px: Array  # (n, 2) in the order of `Chessboard.corners`
    finder: str  # which finder saw it


def find_board(image: Grey, target: Chessboard | PlainChessboard) -> Found | None:
    """The board's corners, or None if no finder sees a complete board that can be put in order."""
    for name, finder in FINDERS.items():
        corners = finder(image, target.inner)
        if corners is None:
            continue
        ordered = _ordered(image, np.asarray(corners, np.float64).reshape(-1, 2), target)
        if ordered is not None:
            return Found(ordered, name)
    return None


def find_sector_based(image: Grey, target: Chessboard | PlainChessboard) -> Found | None:
    """The board as `cv2.findChessboardCornersSB` alone sees it, to its own accuracy."""
    corners = _sector_based(image, target.inner)
    ordered = None if corners is None else _ordered(image, corners.reshape(-1, 2), target)
    return None if ordered is None else Found(ordered, "sector")


def subpix(image: Grey, corners_px: Array) -> Array:
    """Corners (n, 2) px as `cv2.cornerSubPix` moves them."""
    start = corners_px.astype(np.float32).reshape(-1, 1, 2)
    return cv2.cornerSubPix(image, start, SUBPIX_WINDOW, (-1, -1), SUBPIX_STOP).reshape(-1, 2).astype(np.float64)


def _classic(image: Grey, inner: tuple[int, int]) -> Array | None:
    part, offset = _region_of(image)
    flags = CLASSIC_FLAGS | (cv2.CALIB_CB_FAST_CHECK if part.size > UNCHECKED_PIXELS else 0)
    found, corners = cv2.findChessboardCorners(part, inner, flags=flags)
    return corners + offset if found else None


def _whole(image: Grey, inner: tuple[int, int]) -> Array | None:
    found, corners = cv2.findChessboardCorners(image, inner, flags=CLASSIC_FLAGS | cv2.CALIB_CB_FAST_CHECK)
    return np.asarray(corners, np.float64) if found else None


def _enlarged(image: Grey, inner: tuple[int, int]) -> Array | None:
    part, offset = _region_of(image)
    scale = min(ENLARGEMENT, float(np.sqrt(MOST_PIXELS / part.size)))
    if scale < LEAST_ENLARGEMENT or not _worth_trying(part, inner):
        return None
    large = cv2.resize(part, None, fx=scale, fy=scale, interpolation=cv2.INTER_CUBIC)
    found, corners = cv2.findChessboardCorners(large, inner, flags=CLASSIC_FLAGS)
    # Pixel centres at integers: the centre of pixel 0 lies (scale - 1) / 2 into the enlarged image.
    return (corners - (scale - 1.0) / 2.0) / scale + offset if found else None


def _sector_based(image: Grey, inner: tuple[int, int]) -> Array | None:
    part, offset = _region_of(image)
    if not _worth_trying(part, inner):
        return None
    found, corners = cv2.findChessboardCornersSB(np.ascontiguousarray(part), inner, flags=SECTOR_FLAGS)
    return corners + offset if found else None


FINDERS: dict[str, Callable[[Grey, tuple[int, int]], Array | None]] = {
    "classic": _classic,
    "whole": _whole,
    "enlarged": _enlarged,
    "sector": _sector_based,
}


def _worth_trying(part: Grey, inner: tuple[int, int]) -> bool:
    """Whether to search: OpenCV's check is quick and misses small boards; the search takes a minute in large noise."""
    return part.size <= UNCHECKED_PIXELS or bool(cv2.checkChessboard(part, inner))


def _region_of(image: Grey) -> tuple[Grey, Array]:
    region = textured_region(image)
    return image[region.pixels], np.array([region.x, region.y], np.float64)


def textured_region(image: Grey) -> Region:
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


def _ordered(image: Grey, corners: Array, target: Chessboard | PlainChessboard) -> Array | None:
    """Corners in the target's order: x to y turns as the image's axes do, and the first square is the black one."""
    across, down = target.inner
    grid = corners.reshape(down, across, 2)
    along_x, along_y = grid[:, -1].mean(0) - grid[:, 0].mean(0), grid[-1].mean(0) - grid[0].mean(0)
    if along_x[0] * along_y[1] - along_x[1] * along_y[0] < 0.0:
        grid = grid[::-1]
    # Half a turn exchanges black and white. The square between the first four corners is black, as the first is.
    middles = (grid[1:, 1:] + grid[1:, :-1] + grid[:-1, 1:] + grid[:-1, :-1]) / 4.0
    x, y = (np.rint(middles[..., k]).astype(int) for k in range(2))
    if x.min() < 0 or y.min() < 0 or x.max() >= image.shape[1] or y.max() >= image.shape[0]:
        return None
    black = np.add.outer(np.arange(down - 1), np.arange(across - 1)) % 2 == 0
    grey = image[y, x]
    if (across + down) % 2 == 1:
        return (grid if grey[black].mean() < grey[~black].mean() else grid[::-1, ::-1]).reshape(-1, 2)
    return _upright(grid, bool(grey[black].mean() < grey[~black].mean()))


def _upright(grid: Array, is_black_first: bool) -> Array | None:
    """Corners (rows, columns, 2) of a board that looks the same after half a turn: x to the right in the picture.

    A quarter of a turn exchanges black and white, which is no way out for a board that is not square.
    """
    if not is_black_first:
        if grid.shape[0] != grid.shape[1]:
            return None
        grid = np.rot90(grid)
    along_x = grid[:, -1].mean(0) - grid[:, 0].mean(0)
    return (grid if along_x[0] > 0.0 else grid[::-1, ::-1]).reshape(-1, 2)
