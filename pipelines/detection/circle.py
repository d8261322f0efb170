"""The raised circle in an image whose board is known.

The centroid of a projected circle is not the projection of its centre. Here its contour is what the map from board to
image makes of a circle on a plane at its height; the map is good a square beyond the corners, and what it cannot know,
how far the height displaces the circle, is fitted (`pipelines.detection.circle_model`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap
from pipelines.detection.circle_model import (
    BLOCKED,
    DISC_GREY,
    LAMP,
    SHADOW,
    SIZE,
    SOFTNESS,
    WHITE_GREY,
    Patch,
    Prior,
    fit_disc,
)
from pipelines.detection.finders import Grey
from pipelines.detection.kernels import compiled
from render.targets.chessboard import Chessboard
from render.targets.disc_shade import blocked_share

FINE, COARSE = 3, 2  # cells to a pixel along each side: for small patches, for large ones
LARGE_PX = 45  # side of a patch from which the blur is well sampled by the coarse grid
CLEAR_BLURS = 3.0  # blurs between a pixel and the next black square
BAND_PX = 1.5  # pixels of the board around the circle, beyond that
LEAST_PIXELS = 40
START_SHADOW = (0.18, 0.18, 0.18)  # place and softness, in heights of the circle above the board
SIZE_SPREAD = 0.003  # the board's map gives the size to this: nearer or farther it looks the same to five in a thousand
SHADOW_SPREAD, SOFTNESS_MEAN, SOFTNESS_SPREAD = 0.9, 0.15, 0.15  # heights
FURTHEST_SHADOW = 3.6  # heights
LEAST_CONTRAST = 0.35  # of the board's: what a circle's edge must have
SEARCH_SHARE = 0.1  # of a square: how far the centre may lie from where the board predicts it
SIZE_LIMIT = 0.03  # of the size
LEAST_AXIS = 1.5  # blurs: a disc whose smaller half axis is below this has no edges of its own


@dataclass(frozen=True, slots=True)
class Circle:
    """A circle found in an image."""

    centre_px: Array  # (2,) image of the circle's centre
    covariance_px2: Array  # (2, 2)


def find_circle(image: Grey, board: BoardMap, blur_px: float, contrast: float, target: Chessboard) -> Circle | None:
    """The circle's centre, or None if there is no dark disc where the board puts it.

    blur_px, contrast: of the board's edges.
    """
    at, height = target.circle_centre[:2] / target.square_mm, target.circle_height_mm / target.square_mm
    radius = target.circle_radius_mm / target.square_mm
    centre, jacobian = board(at, height), board.jacobian(at, height)
    if np.linalg.svd(jacobian, compute_uv=False)[-1] * radius < LEAST_AXIS * blur_px:
        return None
    patch = _patch(image, board, centre, jacobian, blur_px, target)
    if patch is None:
        return None
    fit = fit_disc(patch, _beforehand(contrast, target.circle_height_mm / target.circle_radius_mm))
    shift = fit.values[:2]
    found = fit.converged and np.linalg.norm(shift) * radius < SEARCH_SHARE and abs(fit.values[SIZE] - 1.0) < SIZE_LIMIT
    if not found or fit.values[WHITE_GREY] - fit.values[DISC_GREY] < LEAST_CONTRAST * contrast:
        return None
    to_px = jacobian * radius
    return Circle(centre + to_px @ shift, to_px @ fit.covariance[:2, :2] @ to_px.T)


def _beforehand(contrast: float, height: float) -> Prior:
    """What is known of the circle before its pixels are looked at; what is not known has a wide spread.

    height: of the circle above the board, radii.
    """
    start = np.array([0.0, 0.0, 1.0, *(height * share for share in START_SHADOW)])
    expected, spread = np.zeros(12), np.full(12, 1e6)
    expected[SIZE], spread[SIZE] = 1.0, SIZE_SPREAD
    spread[SHADOW] = height * SHADOW_SPREAD
    expected[SOFTNESS], spread[SOFTNESS] = height * SOFTNESS_MEAN, height * SOFTNESS_SPREAD
    spread[WHITE_GREY + 1 : BLOCKED] = 0.5 * contrast
    expected[BLOCKED], spread[BLOCKED] = 0.3 * contrast, 0.3 * contrast
    expected[LAMP], spread[LAMP] = 0.6 * contrast, 0.6 * contrast
    return Prior(start, expected, spread, FURTHEST_SHADOW * height)


def _kernel(blur_px: float, finer: int) -> Array:
    """Taps of the blur on the fine grid, an even number of them where the pixel's centre lies between two cells."""
    sigma = np.sqrt(max((blur_px * finer) ** 2 - 1.0 / 12.0, 0.2))  # a fine cell is a mean already
    taps = 2 * int(np.ceil(4.0 * sigma)) + finer % 2
    bell = np.exp(-0.5 * ((np.arange(taps) - (taps - 1) / 2.0) / sigma) ** 2)
    return bell / bell.sum()


def _patch(
    image: Grey, board: BoardMap, centre: Array, jacobian: Array, blur_px: float, target: Chessboard
) -> Patch | None:
    """The pixels around the circle that see it or its white square; None if it reaches out of the image."""
    at, height = target.circle_centre[:2] / target.square_mm, target.circle_height_mm / target.square_mm
    radius = target.circle_radius_mm / target.square_mm
    foot = board(at)
    reach = radius * np.linalg.norm(jacobian, axis=1) + CLEAR_BLURS * blur_px + BAND_PX
    low = np.floor(np.minimum(centre, foot) - reach).astype(int)
    high = np.ceil(np.maximum(centre, foot) + reach).astype(int) + 1
    if np.any(low < 0) or np.any(high > image.shape[::-1]) or np.any(high - low > min(image.shape)):
        return None
    finer = COARSE if np.max(high - low) > LARGE_PX else FINE
    fine_x, fine_y = ((np.arange((high[k] - low[k]) * finer) + 0.5) / finer - 0.5 + low[k] for k in range(2))
    planes = board.meet_planes(fine_x, fine_y, np.array([0.0, height]))
    on_board, on_disc = (planes - at[:, None, None]) / radius
    size = np.sqrt(abs(np.linalg.det(jacobian))) * radius
    blocked = blocked_share(np.hypot(*on_board), 1.0, height / radius)
    shape = (high[1] - low[1], finer, high[0] - low[0], finer)
    squares = (planes[0].reshape(2, *shape)).mean(axis=(2, 4))
    margin = CLEAR_BLURS * blur_px * np.linalg.norm(np.linalg.inv(jacobian), axis=1)
    white = np.empty(squares[0].shape, bool)
    _on_white(squares[0], squares[1], margin, target.columns, target.rows, target.margin_squares, white)
    rows, columns = map(np.ascontiguousarray, np.nonzero(white))
    if len(rows) < LEAST_PIXELS:
        return None
    grey = image[low[1] : high[1], low[0] : high[0]].astype(np.float64)[rows, columns]
    return Patch(
        grey=grey,
        rows=rows,
        columns=columns,
        on_board=on_board,
        on_disc=on_disc,
        slope_x=(fine_x - centre[0])[None] / size,
        slope_y=(fine_y - centre[1])[:, None] / size,
        blocked=blocked,
        per_px=np.linalg.inv(jacobian) / radius,
        kernel=_kernel(blur_px, finer),
        finer=finer,
    )


@compiled
def _on_white(x: Array, y: Array, margin: Array, columns: int, rows: int, border: float, out: Mask) -> None:
    """Which board coordinates x, y (h, w) lie on white and `margin` (2,) squares away from black and the border."""
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            out[i, j] = True
            for k in range(9):
                u, v = x[i, j] + (k % 3 - 1) * margin[0], y[i, j] + (k // 3 - 1) * margin[1]
                column, row = math.floor(u) + 1, math.floor(v) + 1
                inside = -1.0 - border < u < columns - 1 + border and -1.0 - border < v < rows - 1 + border
                black = 0 <= column < columns and 0 <= row < rows and (column + row) % 2 == 0
                if black or not inside:
                    out[i, j] = False


def prepare() -> None:
    """Call the compiled function once."""
    _on_white(np.zeros((0, 0)), np.zeros((0, 0)), np.zeros(2), 4, 4, 1.0, np.zeros((0, 0), bool))
