"""The raised circle in an image whose board is known.

The centroid of a projected circle is not the projection of its centre. Here its contour is what the map from board to
image makes of a circle on a plane at its height; the map is good a square beyond the corners, and what it cannot know,
how far the height displaces the circle, is fitted (`pipelines.detection.circle_model`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.circle_light import fit_in_any_light
from pipelines.detection.circle_model import (
    BLOCKED,
    DISC_GREY,
    LAMP,
    LINEAR,
    OBLONG,
    ROUNDING,
    SHADOW,
    SHAPE,
    SIZE,
    SOFTNESS,
    WHITE_GREY,
    Patch,
    Prior,
    cost_of,
)
from pipelines.detection.consistency import Corners
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
FORM_SPREAD, MISFIT_SLOPES = 0.0001, 6.0  # likewise its form; and misfits of the map, squares, that its slopes are off
SHADOW_SPREAD, SOFTNESS_MEAN, SOFTNESS_SPREAD = 0.9, 0.15, 0.15  # heights
FURTHEST_SHADOW = 3.6  # heights
LEAST_CONTRAST = 0.35  # of the board's: what a circle's edge must have
SEARCH_SHARE = 0.1  # of a square: how far the centre may lie from where the board predicts it, if its map is sure
FARTHEST_SHARE = 0.25  # of a square, however unsure it is
CORNER_PX = 0.01  # an ordinary corner's uncertainty, of which that of the map follows
ASPECT_SPREAD = 0.02  # of pixels that are not known to be square; or as far as the map's are from it
LENS_SPREAD = (100.0, 100.0, 0.3, 0.3, 0.3)  # of the rest of a lens of which nothing is known: see `generic_lens`
SURE_SHARE = 0.01  # of a square: a prediction less sure than this has the circle looked for around it
LOOKS = (5, 9)  # places along both axes of the ellipse in which a circle is looked for
LOOK_SPREADS = 10.0  # half its axes, in deviations of the prediction: it is far from linear
GOOD_SHARE = 1.2  # of the residuals of the best fit in the ellipse, up to which a fit from the prediction is kept
FAR_SPREADS = 3.0  # of the prediction that a circle may lie off, for each that a linear map allows
SIZE_LIMIT = 0.03  # of the size
LARGE_RADIUS_PX = 60.0  # a larger circle is read in means of pixels that leave its edges this blur:
LEAST_BLUR_PX = 0.7  # below it the fine grid would sample them badly
MOST_RADIUS_PX = 150.0  # a larger one is read in means whatever it costs: 0.03 px instead of 0.01, in bounded time
LEAST_AXIS = 1.5  # blurs: a disc whose smaller half axis is below this has no edges of its own

Picture = Grey | NDArray[np.float32]  # (height, width) grey values


@dataclass(frozen=True, slots=True)
class Circle:
    """A circle found in an image."""

    centre_px: Array  # (2,) image of the circle's centre
    covariance_px2: Array  # (2, 2)


def find_circle(
    image: Picture, board: BoardMap, blur_px: float, contrast: float, target: Chessboard, misfit: float = 0.0
) -> Circle | None:
    """The circle's centre, or None if there is no dark disc where the board puts it.

    blur_px, contrast: of the board's edges. misfit: RMS distance of the corners from the board's map, squares.
    """
    at, height = target.circle_centre[:2] / target.square_mm, target.circle_height_mm / target.square_mm
    radius = target.circle_radius_mm / target.square_mm
    axes = np.linalg.svd(board.jacobian(at, height), compute_uv=False) * radius
    if axes[-1] < LEAST_AXIS * blur_px:
        return None
    harmless = min(math.ceil(axes[0] / LARGE_RADIUS_PX), max(1, int(blur_px / LEAST_BLUR_PX)))
    by = max(harmless, math.ceil(axes[0] / MOST_RADIUS_PX))
    if by > 1:
        small = _means(image, by)
        found = _fitted_circle(small, board.reduced(by), blur_px / by, contrast, target, misfit, _unsure(board, target))
        return found and Circle((found.centre_px + 0.5) * by - 0.5, found.covariance_px2 * by**2)
    return _fitted_circle(image, board, blur_px, contrast, target, misfit, _unsure(board, target))


def _means(image: Picture, by: int) -> NDArray[np.float32]:
    """A picture of the means of `by` x `by` pixels; what is left at the right and below is cut off."""
    height, width = (side // by for side in image.shape)
    whole = image[: height * by, : width * by].astype(np.float32)
    return np.asarray(cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA), np.float32)


def _fitted_circle(
    image: Picture, board: BoardMap, blur_px: float, contrast: float, target: Chessboard, misfit: float, unsure: Array
) -> Circle | None:
    """The circle in a picture in which it is not too large.

    unsure: (2, 2) covariance of where the board puts it, squares^2.
    """
    at, height = target.circle_centre[:2] / target.square_mm, target.circle_height_mm / target.square_mm
    radius = target.circle_radius_mm / target.square_mm
    centre, jacobian = board(at, height), board.jacobian(at, height)
    known = _beforehand(contrast, target.circle_height_mm / target.circle_radius_mm, misfit)
    doubt = _doubt(unsure)
    patches = [
        _patch(image, board, centre, jacobian, blur_px, target, more) for more in ((0.0, doubt) if doubt else (0.0,))
    ]
    fits = [
        fit_in_any_light(
            patch,
            replace(known, start=_best_start(patch, known, unsure, radius)) if k else known,
            target.circle_height_mm / target.circle_radius_mm,
            contrast,
        )
        for k, patch in enumerate(patches)
        if patch is not None
    ]
    if not fits:
        return None
    fit = fits[0] if fits[0].residual <= GOOD_SHARE * fits[-1].residual + ROUNDING else fits[-1]
    shift = fit.values[:2]
    found = fit.converged and _is_near(shift * radius, unsure) and abs(fit.values[SIZE] - 1.0) < SIZE_LIMIT
    if not found or fit.values[WHITE_GREY] - fit.values[DISC_GREY] < LEAST_CONTRAST * contrast:
        return None
    to_px = jacobian * radius
    return Circle(centre + to_px @ shift, to_px @ fit.covariance[:2, :2] @ to_px.T)


def misfit_squares(corners: Corners, at: Array) -> float:
    """By how much, RMS squares, the board's map misses the corners at places (n, 2) beyond their noise.

    What a map leaves out is much the same for neighbours, whose noise is not: it is the mean product of their misses.
    """
    low = np.rint(at.min(axis=0)).astype(int)
    columns, rows = (np.rint(at).astype(int) - low).T
    side = np.sqrt(np.abs(np.linalg.det(corners.board.jacobian(at))))
    missed = np.full((rows.max() + 1, columns.max() + 1, 2), np.nan)
    misses = (corners.points_px - corners.board(at)) / side[:, None]
    missed[rows, columns] = np.where(corners.consistent[:, None], misses, np.nan)
    products = [missed[1:] * missed[:-1], missed[:, 1:] * missed[:, :-1]]
    both = np.concatenate([product.ravel() for product in products])
    both = both[np.isfinite(both)]
    return float(np.sqrt(max(2.0 * both.mean(), 0.0))) if len(both) else 0.0


def _unsure(board: BoardMap, target: Chessboard) -> Array:
    """(2, 2) covariance, squares^2, of how far the circle's height displaces it, as one view of the corners tells it.

    Whether a lens is longer along x than along y looks much like a tilt.
    """
    at, height = target.circle_centre[None, :2] / target.square_mm, target.circle_height_mm / target.square_mm
    slopes = board.slopes(grid(target.inner)).reshape(2 * target.circle_index, -1) / CORNER_PX
    spread = np.array([max(ASPECT_SPREAD, abs(board.lens[1])), *LENS_SPREAD])
    slopes = np.vstack((slopes, np.diag(np.append(np.zeros(7), 1.0 / spread))))
    displaced = (board.slopes(at, height) - board.slopes(at))[0]
    size = np.maximum(np.linalg.norm(slopes, axis=0), 1e-12)
    change = np.linalg.inv(board.jacobian(at[0])) @ displaced / size
    return change @ np.linalg.pinv((slopes / size).T @ (slopes / size), rcond=1e-12, hermitian=True) @ change.T


def _doubt(unsure: Array) -> float:
    """Squares around the prediction in which the circle is looked for; 0 where the prediction is sure."""
    spread = math.sqrt(np.linalg.eigvalsh(unsure)[-1])
    return min(LOOK_SPREADS * spread, FARTHEST_SHARE) if spread > SURE_SHARE else 0.0


def _best_start(patch: Patch, known: Prior, unsure: Array, radius: float) -> Array:
    """The best start on a grid over the ellipse in which the prediction is unsure.

    unsure: (2, 2) covariance of the prediction, squares^2. radius: of the circle, squares.
    """
    variances, axes = np.linalg.eigh(unsure)
    reach = np.minimum(LOOK_SPREADS * np.sqrt(np.maximum(variances, 0.0)), FARTHEST_SHARE) / radius
    minor, major = (np.linspace(-far, far, count) for far, count in zip(reach, LOOKS, strict=True))
    starts = [
        known.start + np.append(a * axes[:, 0] + b * axes[:, 1], np.zeros(SHAPE - 2)) for a in minor for b in major
    ]
    return min(starts, key=lambda start: cost_of(patch, known, start))


def _is_near(shift: Array, unsure: Array) -> bool:
    """Whether a circle that lies so many squares from its prediction is this board's."""
    allowed = FAR_SPREADS**2 * unsure + (SEARCH_SHARE / 3.0) ** 2 * np.eye(2)
    return bool(shift @ np.linalg.solve(allowed, shift) < 9.0 and np.linalg.norm(shift) < FARTHEST_SHARE)


def _beforehand(contrast: float, height: float, misfit: float) -> Prior:
    """What is known of the circle before its pixels are looked at; what is not known has a wide spread.

    height: of the circle above the board, radii.
    """
    start = np.array([0.0, 0.0, 1.0, 0.0, 0.0, *(height * share for share in START_SHADOW)])
    expected, spread = np.zeros(SHAPE + LINEAR), np.full(SHAPE + LINEAR, 1e6)
    expected[SIZE], spread[SIZE] = 1.0, math.hypot(SIZE_SPREAD, MISFIT_SLOPES * misfit)
    spread[OBLONG] = math.hypot(FORM_SPREAD, MISFIT_SLOPES * misfit)
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
    image: Picture, board: BoardMap, centre: Array, jacobian: Array, blur_px: float, target: Chessboard, doubt: float
) -> Patch | None:
    """The pixels around the circle that see it or its white square; None if it reaches out of the image.

    doubt: squares by which the circle may lie elsewhere.
    """
    at, height = target.circle_centre[:2] / target.square_mm, target.circle_height_mm / target.square_mm
    radius = target.circle_radius_mm / target.square_mm
    foot = board(at)
    reach = (radius + doubt) * np.linalg.norm(jacobian, axis=1) + CLEAR_BLURS * blur_px + BAND_PX
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
        shadows=np.empty((0, *blocked.shape)),
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
