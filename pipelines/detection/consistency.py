"""Corners of one board against each other: each must agree with the map through the others."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap, Hold
from pipelines.detection.corner_scatter import leverage, scatter_about
from pipelines.detection.encoding import PLAIN, Encoding
from pipelines.detection.lone_errors import stated_errors
from pipelines.detection.row_moves import RowMoves
from pipelines.detection.smooth_extension import smooth_extension

LIMIT_PX = 0.5  # largest distance of a corner from the map through the others
LIMIT_SHARE = 0.03  # or this share of the local square, whichever is more
LIMIT_SPREADS, MOST_SHARE = 4.0, 0.15  # or so many median distances, up to this share of the local square
SHARP_SPREADS, SHARP_PX = 12.0, 0.1  # but no more than so many median distances, nor less than this: beside what covers
# a part of the board a corner may be half a pixel off where all others agree to a hundredth
MOST_BLURS = 0.25  # that a corner whose own pixels state more than the others' may be off, so many times more: light
# from elsewhere, of a tenth of the contrast, moves an edge so far. It states its distance as its error
PLACED_PX = 0.1  # deviation of a corner that something else placed, until their scatter is known
BAD_SHARE = 0.25  # of the corners that may be inconsistent before the board is, and one of few in any case


@dataclass(frozen=True, slots=True)
class Corners:
    """Corners of one picture in the order of `Chessboard.corners`."""

    points_px: Array  # (n, 2)
    covariance_px2: Array  # (n, 2, 2)
    consistent: Mask  # (n,) converged, and agrees with the map through the others
    blur_px: float  # median blur of the edges
    contrast: float  # median difference between white and black, grey values
    board: BoardMap  # through the consistent ones
    noise: float = np.nan  # median variance of what the fits leave, grey values^2
    widths_beyond_px: tuple[float, float] = (np.nan, np.nan)  # of edges along x and y, see `widths_beyond`
    encoding: Encoding = PLAIN  # of the picture
    scatter: float = 1.0  # factor, in the covariances, of what the corners' own pixels state, see `corner_scatter`
    rows_px2: float = 0.0  # mean square of how far rows are moved from the map, see `row_moves`


def drop_inconsistent(corners: Corners, at: Array, size: tuple[int, int], moves: RowMoves | None = None) -> Corners:
    """Drop the corner farthest from the map through the others until all the rest agree; scale the covariances.

    Corners that are fitted to their own pixels lie where these show them, also where the board's map is a little wrong.
    So the covariances are scaled by what differs from corner to corner, and single corners that lie far from the others
    state that. moves: of the picture's rows, which are no errors of the corners either.
    """
    agreed = _agreeing(corners, at, size)
    good = agreed.consistent
    if not np.any(good):
        return agreed
    rows = 0.0
    parts = (at, agreed.points_px - agreed.board(at), agreed.covariance_px2, agreed.board.slopes(at))
    places, missed, covariance, slopes = (part[good] for part in parts)
    if moves is not None:
        slopes = np.concatenate((slopes, moves.terms(agreed.points_px[good, 1])), axis=2)
        rows = float(np.mean(missed**2))
    stated = agreed.covariance_px2.copy()
    stated[good], factor = stated_errors(places, missed, covariance, slopes)
    return replace(agreed, covariance_px2=stated, scatter=factor, rows_px2=rows)


def _agreeing(corners: Corners, at: Array, size: tuple[int, int]) -> Corners:
    """The corners of which each agrees with the map through the others, and that map."""
    good, points = corners.consistent.copy(), corners.points_px
    side = np.sqrt(np.abs(np.linalg.det(corners.board.jacobian(at))))
    board, own = corners.board, _own(corners, good)
    for _ in range(max(1, int(BAD_SHARE * len(points))) + 1):
        if 2 * np.sum(good) <= board.slopes(at).shape[-1]:
            return replace(corners, consistent=np.zeros(len(at), bool))
        weights, board = _weights(corners.covariance_px2, good), _map_through(corners, good, board, at, size)
        distance, spread = _left_out(points, board, at, weights)
        typical = float(np.median(distance[good])) * spread
        excess = np.where(good, distance / _limits(side, typical, spread, own), 0.0)
        worst = int(np.argmax(excess))
        if excess[worst] <= 1.0:
            back = _taken_back(corners, good, board, at, weights)
            if np.any(back):
                good |= back
                board = _map_through(corners, good, board, at, size)
            break
        good[worst] = False
    return replace(corners, consistent=good, board=board)


def _map_through(corners: Corners, good: Mask, start: BoardMap, at: Array, size: tuple[int, int]) -> BoardMap:
    """The map through the good corners, from one near by.

    Where it does not follow the board, its lens may bend only as far as what it misses tells.
    """
    missed = np.sqrt(0.5 * np.median(np.sum((corners.points_px - start(at))[good] ** 2, axis=1)))
    hold = Hold(max(hold_of(corners.covariance_px2, good).deviation_px, float(missed)))
    return BoardMap.fit(at, corners.points_px, size, _weights(corners.covariance_px2, good), start, hold)


def _taken_back(corners: Corners, good: Mask, board: BoardMap, at: Array, weights: Array) -> Mask:
    """(n,) which corners that were dropped agree after all with the map through the others, or an extension of it.

    While such a corner took part, its distance from the map through the others was worked out as for small changes of
    the map.
    """
    lost, back = np.flatnonzero(corners.consistent & ~good), np.zeros(len(good), bool)
    if not len(lost):
        return back
    missed = corners.points_px - board(at)
    usual = float(np.median(_left_out(corners.points_px, board, at, weights)[0][good]))
    side = np.sqrt(np.abs(np.linalg.det(board.jacobian(at[lost]))))
    same, own = np.ones(len(lost)), _own(corners, good)[:, lost]
    back[lost] = np.linalg.norm(missed[lost], axis=1) <= _limits(side, usual * same, same, own)
    extended = smooth_extension(at[good], missed[good], at[lost], missed[lost], usual)
    if extended is not None:
        limits = _limits(side, extended.typical * extended.spread, same, own)
        back[lost] |= np.linalg.norm(extended.missed, axis=1) <= limits
    return back


def _limits(side: Array, typical: Array, spread: Array, own: Array) -> Array:
    """(n,) largest distances from the map through the others, px.

    side: (n,) of the local squares, px. typical: (n,) median distance times `spread`, px. spread: see `_left_out`.
    own: see `_own`.
    """
    times, most = own
    sharp = np.maximum(SHARP_SPREADS * typical, SHARP_PX * spread)
    sharp = np.maximum(sharp, np.minimum(SHARP_SPREADS * typical * times, most))
    usual = np.minimum(np.maximum(LIMIT_PX, LIMIT_SHARE * side), sharp)
    return np.maximum(usual, np.minimum(LIMIT_SPREADS * typical, MOST_SHARE * side))


def _own(corners: Corners, good: Mask) -> Array:
    """(2, n) how many times the median deviation of the good corners each states of itself, at least once; px at most.

    Once where nothing is known, as of discs, which have no blur of edges.
    """
    variance = np.trace(corners.covariance_px2, axis1=1, axis2=2)
    usual = np.median(variance[good]) if np.any(good) else np.inf
    times = np.sqrt(np.fmax(variance / usual, 1.0))
    return np.stack((times, np.full(len(times), MOST_BLURS * np.nan_to_num(corners.blur_px))))


def too_many_bad(consistent: Mask) -> bool:
    """Whether so many corners are inconsistent that none is believed."""
    return int(np.sum(~consistent)) > max(1.0, BAD_SHARE * len(consistent))


def check_placed(points_px: Array, fitted: Corners, at: Array, size: tuple[int, int]) -> Corners:
    """Corners that something else placed, (n, 2) px, checked as our own are; blur and contrast are those of our fit.

    Nothing is known of their uncertainties but the scatter about the map, the same for all.
    """
    same = np.repeat(PLACED_PX**2 * np.eye(2)[None], len(at), axis=0)
    started = replace(fitted, points_px=points_px, covariance_px2=same, consistent=np.ones(len(at), bool))
    agreed = _agreeing(started, at, size)
    good = agreed.consistent
    if not np.any(good):
        return agreed
    factor = scatter_about(agreed.board.slopes(at)[good], (points_px - agreed.board(at))[good], same[good])
    return replace(agreed, covariance_px2=same * factor)


def _weights(covariance: Array, good: Mask) -> Array:
    """(n,) inverse mean variances, relative to the median one."""
    variance = np.where(good, 0.5 * np.trace(covariance, axis1=1, axis2=2), np.inf)
    return np.median(variance[good]) / variance


def hold_of(covariance: Array, good: Mask) -> Hold:
    """How firmly corners with (n, 2, 2) covariances leave the lens of their map where it usually is."""
    return Hold(float(np.sqrt(0.5 * np.median(np.trace(covariance[good], axis1=1, axis2=2)))))


def _left_out(points: Array, board: BoardMap, at: Array, weights: Array) -> tuple[Array, Array]:
    """(n,) distance of each corner from the map fitted to the others, px, and by what factor it scatters more.

    Where the others hardly tell the map, as beside the board's own corners, a small error of theirs moves it far.
    """
    slopes = board.slopes(at)
    scaled = (slopes * np.sqrt(weights)[:, None, None]).reshape(-1, slopes.shape[-1])
    own = leverage(scaled).reshape(-1, 2).max(axis=1)
    left = np.maximum(1.0 - own, 1e-3)
    return np.linalg.norm(points - board(at), axis=1) / left, 1.0 / np.sqrt(left)


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
