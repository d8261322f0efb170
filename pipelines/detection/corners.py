"""From a found board to sub-pixel corners with their uncertainties, checked against each other."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap, grid, normal_angles
from pipelines.detection.corner_model import BLUR, CONTRAST, MEAN, SHAPE, SLOPE, CornerTask, fit_corners
from pipelines.detection.finders import Grey
from render.targets.chessboard import Chessboard

FIRST_WINDOW_PX, WINDOW_PX = 5, 10  # half side of the pixels that the first and the final fit may use
FIRST_STEPS, STEPS = 5, 12
STOP = 0.5  # step, in standard deviations, at which a fit has converged; it is still made
START_BLUR_PX = 0.8
REACH, LEAST_REACH = 0.55, 0.25  # squares from the corner; at most this far, at least this far
CLEAR_BLURS = 2.6  # blurs to keep between a fit's pixels and the next edge
CIRCLE_MARGIN_PX = 2.5  # kept clear around the circle and its shade: three times a sharp picture's blur
FARTHEST_PARALLAX = 3.0  # heights of the circle: a larger one is an ambiguous map's invention
SMALL_PARALLAX = 0.3  # squares: up to here the circle may be displaced either way, which a small tilt leaves open
START_LIMIT = 0.3  # of the local square: a fit that moves further has gone to another corner
LIMIT_PX = 0.5  # largest distance of a corner from the map through the others
LIMIT_SHARE = 0.03  # or this share of the local square, whichever is more
LIMIT_SPREADS, MOST_SHARE = 4.0, 0.15  # or so many median distances, up to this share of the local square
BAD_SHARE = 0.1  # of the corners that may be inconsistent before the board is
OWN_NOISE = 0.33  # share of a corner's own noise in what is stated for it; the rest is the board's median
PRIOR_FREEDOM = 10.0  # degrees of freedom with which the pixels' own noise counts against the corners' scatter


@dataclass(frozen=True, slots=True)
class Corners:
    """Refined corners in the order of `Chessboard.corners`."""

    points_px: Array  # (n, 2)
    covariance_px2: Array  # (n, 2, 2)
    consistent: Mask  # (n,) converged, and agrees with the map through the others
    blur_px: float  # median blur of the edges
    contrast: float  # median difference between white and black, grey values
    board: BoardMap  # through the consistent ones


def refine_corners(image: Grey, board: BoardMap, target: Chessboard) -> Corners:
    """Fit every corner near where `board` puts it, clear of the circle: once near by, then over the whole window."""
    at, size = grid(target.inner), (image.shape[1], image.shape[0])
    near, found = _fit(image, board, target, _start_shapes(board, at, START_BLUR_PX), FIRST_WINDOW_PX, FIRST_STEPS)
    good = near.consistent
    if np.mean(~good) > 0.5:
        return near
    board = BoardMap.fit(at, near.points_px, size, good * 1.0, board)
    shapes = _start_shapes(board, at, near.blur_px)
    shapes[good, :2] = near.points_px[good] - board(at)[good]
    shapes[good, MEAN:] = found[good, MEAN:]
    return _checked(_fit(image, board, target, shapes, WINDOW_PX, STEPS)[0], at, size)


def unrefined(points_px: Array, fitted: Corners, at: Array, size: tuple[int, int]) -> Corners:
    """Corners that something else placed, (n, 2) px, checked likewise; blur and contrast are those of our fit.

    Nothing is known of their uncertainties but the scatter about the map, the same for all.
    """
    same = np.repeat(np.eye(2)[None], len(at), axis=0)
    started = replace(fitted, points_px=points_px, covariance_px2=same, consistent=np.ones(len(at), bool))
    return _checked(started, at, size, prior=0.0)


def _start_shapes(board: BoardMap, at: Array, blur_px: float) -> Array:
    shapes = np.full((len(at), SHAPE), np.nan)
    shapes[:, :2] = 0.0
    shapes[:, 2:4] = normal_angles(board.jacobian(at))
    shapes[:, BLUR] = blur_px
    shapes[:, SLOPE:] = 0.0
    shapes[:, MEAN] = np.nan
    return shapes


def _fit(
    image: Grey, board: BoardMap, target: Chessboard, shapes: Array, window: int, steps: int
) -> tuple[Corners, Array]:
    """One pass over all corners, and their shapes; consistent is what converged to a corner of the right sense."""
    at = grid(target.inner)
    starts, jacobian = board(at), board.jacobian(at)
    lengths = np.linalg.norm(jacobian, axis=1)
    reach = np.clip(1.0 - CLEAR_BLURS * shapes[:, BLUR, None] / lengths, LEAST_REACH, REACH)
    discs, disc_axes = _around_circle(board, target)
    task = CornerTask(
        starts=starts,
        shapes=shapes,
        bends=board.curvatures(at, jacobian),
        inverses=np.linalg.inv(jacobian),
        reaches=reach,
        window=window,
        discs=discs,
        disc_axes=disc_axes,
    )
    fitted, covariance, noise, converged = fit_corners(image, task, steps, STOP)
    points = fitted[:, :2]
    with np.errstate(invalid="ignore"):
        side = np.sqrt(np.abs(np.linalg.det(jacobian)))
        good = np.linalg.norm(points - starts, axis=1) <= START_LIMIT * side
        good &= fitted[:, CONTRAST] * _sense(target) > 0.0
        good &= np.all(np.isfinite(covariance), axis=(1, 2)) & (np.linalg.det(covariance) > 0.0)
        good &= converged if window == WINDOW_PX else True
    if not np.any(good):
        return Corners(points, covariance, good, np.nan, np.nan, board), fitted
    # A corner's own few pixels tell its noise to a tenth; weights that scatter so much would promise too much.
    covariance *= (OWN_NOISE * noise + (1.0 - OWN_NOISE) * np.median(noise[good]))[:, None, None]
    blur, contrast = np.median(fitted[good, BLUR]), 2.0 * np.median(np.abs(fitted[good, CONTRAST]))
    return Corners(points, covariance, good, float(blur), float(contrast), board), fitted


def _sense(target: Chessboard) -> Array:
    """(n,) sign of a corner's contrast.

    `normal_angles` points one normal along x and the other against y, so that the first square, which is black, lies
    where the product of the signs of the sides is negative: the contrast at the first corner is positive.
    """
    return np.where(grid(target.inner).sum(axis=1) % 2 == 0, 1.0, -1.0)


def _around_circle(board: BoardMap, target: Chessboard) -> tuple[Array, Array]:
    """Ellipses to leave out: the circle's foot and where its height may displace it; from px to the unit circle."""
    foot, height = target.circle_centre[:2] / target.square_mm, target.circle_height_mm / target.square_mm
    base, jacobian = board(foot), board.jacobian(foot)
    inverse = np.linalg.inv(jacobian)
    parallax = board(foot, height) - base
    squares = float(np.linalg.norm(inverse @ parallax))
    ways = [0.0] if squares > FARTHEST_PARALLAX * height else [0.0, 1.0, -1.0][: 3 if squares <= SMALL_PARALLAX else 2]
    radius = target.circle_radius_mm / target.square_mm + CIRCLE_MARGIN_PX * np.linalg.norm(inverse, axis=1).max()
    return base + np.array(ways)[:, None] * parallax, inverse / radius


def _checked(corners: Corners, at: Array, size: tuple[int, int], prior: float = PRIOR_FREEDOM) -> Corners:
    """Drop the corner farthest from the map through the others until all the rest agree; scale the covariances."""
    good, points = corners.consistent.copy(), corners.points_px
    side = np.sqrt(np.abs(np.linalg.det(corners.board.jacobian(at))))
    board = corners.board
    for _ in range(int(BAD_SHARE * len(points)) + 1):
        if 2 * np.sum(good) <= board.slopes(at).shape[-1]:
            return replace(corners, consistent=np.zeros(len(at), bool))
        weights = _weights(corners.covariance_px2, good)
        board = BoardMap.fit(at, points, size, weights, board)
        distance = _left_out(points, board, at, weights)
        spread = LIMIT_SPREADS * float(np.median(distance[good]))
        limit = np.maximum(np.maximum(LIMIT_PX, LIMIT_SHARE * side), np.minimum(spread, MOST_SHARE * side))
        excess = np.where(good, distance / limit, 0.0)
        worst = int(np.argmax(excess))
        if excess[worst] <= 1.0:
            break
        good[worst] = False
    factor = _scatter(points, corners.covariance_px2, board, at, good, prior)
    return replace(corners, covariance_px2=corners.covariance_px2 * factor, consistent=good, board=board)


def _weights(covariance: Array, good: Mask) -> Array:
    """(n,) inverse mean variances, relative to the median one."""
    variance = np.where(good, 0.5 * np.trace(covariance, axis1=1, axis2=2), np.inf)
    return np.median(variance[good]) / variance


def _left_out(points: Array, board: BoardMap, at: Array, weights: Array) -> Array:
    """(n,) distance of each corner from the map fitted to the others, px."""
    slopes = board.slopes(at)
    scaled = (slopes * np.sqrt(weights)[:, None, None]).reshape(-1, slopes.shape[-1])
    leverage = _leverage(scaled).reshape(-1, 2).max(axis=1)
    return np.linalg.norm(points - board(at), axis=1) / np.maximum(1.0 - leverage, 1e-3)


def _scatter(points: Array, covariance: Array, board: BoardMap, at: Array, use: Mask, prior: float) -> float:
    """Mean square of the corners' distances from the map, in units of their covariances.

    What the pixels' noise cannot tell is in here: rounding that runs along an edge, and what a model leaves out.
    """
    whitener = np.linalg.cholesky(np.linalg.inv(covariance[use])).transpose(0, 2, 1)
    residuals = (whitener @ (points - board(at))[use][..., None]).ravel()
    slopes = (whitener @ board.slopes(at)[use]).reshape(len(residuals), -1)
    free = len(residuals) - float(_leverage(slopes).sum())
    return float((np.sum(residuals**2) + prior) / (free + prior))


def _leverage(slopes: Array) -> Array:
    """(m,) diagonal of the hat matrix of (m, k) rows, of which some columns may say the same."""
    size = np.linalg.norm(slopes, axis=0)
    left, singular, _ = np.linalg.svd(slopes / np.where(size > 0.0, size, 1.0), full_matrices=False)
    return np.sum(left[:, singular > 1e-9 * singular[0]] ** 2, axis=1)
