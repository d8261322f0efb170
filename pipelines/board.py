"""The chessboard in an image, without any hint of where it is: found by OpenCV, put in the board's own order.

Finders, in order: classic on the whole image (5 to 20 ms), classic on the textured region enlarged, sector-based.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from render.target import Target

Grey = NDArray[np.uint8]

ENLARGEMENT = 3  # the classic finder needs squares of about 10 px; tilted ones are smaller
CLASSIC_FLAGS = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
SECTOR_FLAGS = cv2.CALIB_CB_ACCURACY | cv2.CALIB_CB_EXHAUSTIVE


@dataclass(frozen=True, slots=True)
class Found:
    """A complete board in an image, to about a pixel."""

    corners_px: Array  # (n, 2) in the order of `Target.corners`
    finder: str  # which finder saw it


def find_board(image: Grey, target: Target) -> Found | None:
    """The board's corners, or None if no finder sees a complete board that can be put in order."""
    for name, finder in FINDERS.items():
        corners = finder(image, target.inner)
        if corners is None:
            continue
        ordered = _ordered(image, np.asarray(corners, np.float64).reshape(-1, 2), target)
        if ordered is not None:
            return Found(ordered, name)
    return None


def _classic(image: Grey, inner: tuple[int, int]) -> Array | None:
    found, corners = cv2.findChessboardCorners(image, inner, flags=CLASSIC_FLAGS | cv2.CALIB_CB_FAST_CHECK)
    return np.asarray(corners, np.float64) if found else None


def _enlarged(image: Grey, inner: tuple[int, int]) -> Array | None:
    x, y, width, height = textured_region(image)
    part = image[y : y + height, x : x + width]
    large = cv2.resize(part, None, fx=ENLARGEMENT, fy=ENLARGEMENT, interpolation=cv2.INTER_CUBIC)
    found, corners = cv2.findChessboardCorners(large, inner, flags=CLASSIC_FLAGS)
    # Pixel centres at integers: the centre of pixel 0 lies (ENLARGEMENT - 1) / 2 into the enlarged image.
    return (corners - (ENLARGEMENT - 1) / 2) / ENLARGEMENT + np.array([x, y]) if found else None


def _sector_based(image: Grey, inner: tuple[int, int]) -> Array | None:
    x, y, width, height = textured_region(image)
    part = np.ascontiguousarray(image[y : y + height, x : x + width])
    found, corners = cv2.findChessboardCornersSB(part, inner, flags=SECTOR_FLAGS)
    return corners + np.array([x, y]) if found else None


FINDERS: dict[str, Callable[[Grey, tuple[int, int]], Array | None]] = {
    "classic": _classic,
    "enlarged": _enlarged,
    "sector": _sector_based,
}


def textured_region(image: Grey, margin: int = 12) -> tuple[int, int, int, int]:
    """x, y, width, height of the pixels with strong edges; the whole image if there are none."""
    gradient = cv2.morphologyEx(image, cv2.MORPH_GRADIENT, np.ones((3, 3), np.uint8))
    strong = gradient > max(16, int(gradient.max()) // 3)
    columns, rows = np.flatnonzero(strong.any(axis=0)), np.flatnonzero(strong.any(axis=1))
    if not len(columns):
        return 0, 0, image.shape[1], image.shape[0]
    x0, x1 = max(0, columns[0] - margin), min(image.shape[1], columns[-1] + margin + 1)
    y0, y1 = max(0, rows[0] - margin), min(image.shape[0], rows[-1] + margin + 1)
    return int(x0), int(y0), int(x1 - x0), int(y1 - y0)


def _ordered(image: Grey, corners: Array, target: Target) -> Array | None:
    """Corners in the target's order: x to y turns as the image's axes do, and the first square is the black one."""
    across, down = target.inner
    grid = corners.reshape(down, across, 2)
    along_x, along_y = grid[:, -1].mean(0) - grid[:, 0].mean(0), grid[-1].mean(0) - grid[0].mean(0)
    if along_x[0] * along_y[1] - along_x[1] * along_y[0] < 0.0:
        grid = grid[::-1]
    turned = grid[::-1, ::-1]
    first, last = _grey(image, _outer_square(grid)), _grey(image, _outer_square(turned))
    if first is None or last is None:
        return None
    return (grid if first < last else turned).reshape(-1, 2)


def _outer_square(corners: Array) -> Array:
    """Centre of the outer square at the first corner of a (down, across, 2) grid, extrapolated along the diagonal."""
    return (15.0 * corners[0, 0] - 10.0 * corners[1, 1] + 3.0 * corners[2, 2]) / 8.0


def _grey(image: Grey, point: Array) -> float | None:
    x, y = np.rint(point).astype(int)
    if not (0 <= x < image.shape[1] and 0 <= y < image.shape[0]):
        return None
    return float(image[max(0, y - 1) : y + 2, max(0, x - 1) : x + 2].mean())
