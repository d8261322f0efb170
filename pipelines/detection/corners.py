"""Every corner of a board fitted to the picture, from a first map: to a fraction of a pixel, with its covariance."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap, normal_angles
from pipelines.detection.circle_shade import without_shade
from pipelines.detection.circle_surroundings import ellipses_around_circle
from pipelines.detection.consistency import Corners, drop_inconsistent
from pipelines.detection.corner_blur import measured_blur, widths_beyond
from pipelines.detection.corner_model import fit_corners
from pipelines.detection.corner_picture import BLUR, CONTRAST, MEAN, SHAPE, SLOPE, CornerTask
from pipelines.detection.corner_shadow import fit_shadowed, looks_shadowed
from pipelines.detection.corner_sites import CornerSites
from pipelines.detection.edge_form_errors import FORM_SHARE, form_errors
from pipelines.detection.encoding import PLAIN, measured_encoding
from pipelines.detection.finders import Grey
from pipelines.detection.hot_pixels import without_hot_pixels
from pipelines.detection.next_map import form_reach, next_map
from pipelines.detection.row_moves import RowMoves, row_moves
from pipelines.detection.time_limit import Check, unlimited
from pipelines.detection.tone_curve import Light, decoded

STOP = 0.5  # step, in standard deviations, at which a fit has converged; it is still made
LEAST_CLEAR = 0.5  # of a place's own `clear`, however blurred the print beyond is
CLEAR_BLURS = 2.6  # blurs to keep between a fit's pixels and the next edge
START_LIMIT = 0.3  # of the local square: a fit that moves further has gone to another corner
OWN_NOISE = 0.33  # share of a corner's own noise in what is stated for it; the rest is the board's median
SURE_NOISE = 0.7  # of a corner's own noise that is stated at least: its pixels tell it to a tenth
MOST_NOISE = 50.0  # of the board's median variance: a corner beyond it is covered, and no model of an edge is right
NEAR_PX, NEAR_BLURS = 5, 2.5  # radius of the first window, px and blurs
FINAL_PX, FARTHEST_PX = 10, 100  # least and largest radius of the final one
BAND_PX, BAND_BLURS = 1.0, 3.0  # to either side of an edge: pixels farther off tell nothing of its place
SHARP_PX = 0.6  # blur below which a pixel's area is no gaussian
MOST_LOST = 0.5  # of the corners
LEAST_CONTRAST = 0.2  # of the board's: a corner in a shadow has it, a covered one has not
PLAIN_NOISE = 4.0  # of the board's median variance: twice the deviation, which no corner's own scatter reaches
SHADOW_PX, SHADOW_BLURS, FARTHEST_SHADOW_PX = 10.0, 3.5, 30.0  # radius of the window that shows a shadow's edge
LEAST_KEPT = 0.9  # of the corners: a motion of the rows loses none
FEW = 24  # corners that hardly tell a map's parameters: they are fitted again from the better map


class _Pass(NamedTuple):
    """Limits of one fit of every corner."""

    steps: int
    must_converge: bool
    reach: float  # squares that the window may reach along the edges; 0 where it is to be small
    is_shadowed: bool = False  # whether a shadow's edge may cross the corner
    moves: RowMoves | None = None  # of the picture's rows


NEAR = _Pass(steps=8, must_converge=False, reach=0.0)  # enough for a map to start the final one from
SMALL = _Pass(steps=40, must_converge=True, reach=0.0)  # for corners beside what the final one's model lacks
FINAL = _Pass(steps=40, must_converge=True, reach=1.0)
SHADOWED = SMALL._replace(is_shadowed=True)  # for corners that these do not explain


def refine_corners(
    image: Grey,
    board: BoardMap,
    sites: CornerSites,
    unseen: CornerSites | None = None,
    check_time: Check = unlimited,
) -> Corners:
    """Fit every corner near where `board` puts it, clear of the circle: once near by, then over all of its edges.

    unseen: further corners of the board; they are looked for where the map through the others puts them, and stand
    behind them in what is returned.
    """
    at, size = sites.at, (image.shape[1], image.shape[0])
    image = without_hot_pixels(image, board(at), float(np.abs(board.jacobian(at)).max()))
    light = decoded(image, 1.0)
    starts = _start_shapes(board, at, measured_blur(light, board, sites))
    corners, shapes, _ = _fit(light, board, sites, starts, NEAR)
    encoding, limits = None, NEAR
    for _ in range(2 if len(at) < FEW else 1):
        check_time()
        good = corners.consistent
        if np.mean(~good) > MOST_LOST:
            return corners
        board = next_map(corners, board, at, size)
        if encoding is None:
            encoding, light = measured_encoding(image, light, board, sites, corners.blur_px)
            if encoding.sharpening is not None:
                starts = _start_shapes(board, at, measured_blur(light, board, sites))
                corners, shapes, _ = _fit(light, board, sites, starts, NEAR)
            if sites.circled is not None:
                light = without_shade(light, board, sites.circled, corners.blur_px)
        limits = FINAL._replace(reach=form_reach(corners, board, at))
        corners, shapes, _ = _fit(light, board, sites, _next_shapes(corners, shapes, board, at), limits)
    good = corners.consistent
    moves = row_moves(at[good], corners.points_px[good], corners.covariance_px2[good], board)
    if moves is not None:
        still = corners.points_px - moves(corners.points_px[:, 1])
        through = next_map(replace(corners, points_px=still), board, at, size)
        moved, starts = limits._replace(moves=moves), _next_shapes(corners, shapes, through, at)
        again, _, _ = _fit(light, through, sites, starts, moved)
        if np.sum(again.consistent) < LEAST_KEPT * np.sum(good):
            moves = None  # what seemed to move rows moves edges otherwise
        else:
            corners, board, limits = again, through, moved
    corners = replace(corners, encoding=encoding or PLAIN)
    if np.mean(~corners.consistent) <= MOST_LOST:
        corners = replace(corners, board=next_map(corners, corners.board, at, size))
        beyond = widths_beyond(light, corners.board, sites, corners.blur_px)
        corners = replace(corners, widths_beyond_px=(float(beyond[0]), float(beyond[1])))
        sites, corners = _with_nearby(light, sites, unseen, corners)
    corners = drop_inconsistent(corners, sites.at, size, moves)
    if not np.any(corners.consistent):
        return corners
    return _with_form_errors(corners, sites, limits, size, len(at) < FEW)


def _with_form_errors(corners: Corners, sites: CornerSites, limits: _Pass, size: tuple[int, int], few: bool) -> Corners:
    """The corners with what the forms of their edges add, where few corners tell these, or moves of rows bend them."""
    added = np.zeros((len(sites.at), 2, 2))
    if few:
        added += form_errors(corners, sites.at, min(sites.reach, limits.reach), size)
    if limits.moves is not None:
        jacobian = corners.board.jacobian(sites.at)
        pulls = FORM_SHARE * _final_windows(sites, jacobian, limits) ** 2
        added += limits.moves.form_errors(corners.board(sites.at)[:, 1], jacobian, pulls)
    return replace(corners, covariance_px2=corners.covariance_px2 + added)


def _with_nearby(
    image: Light, sites: CornerSites, unseen: CornerSites | None, corners: Corners
) -> tuple[CornerSites, Corners]:
    """Corners that no final fit explains, and those that were not seen, fitted to the nearest pixels alone.

    An edge that is no board's, as of a hard shadow, may run through a square and leave its corners free. Where those
    pixels, too, show more than noise, the edge may be a shadow's that runs through them, and is fitted with the corner.
    """
    if unseen is not None:
        sites, corners = sites.followed_by(unseen), _with_places_for(corners, len(unseen.at))
    points, covariance, good = corners.points_px.copy(), corners.covariance_px2.copy(), corners.consistent.copy()
    starts, least = _start_shapes(corners.board, sites.at, corners.blur_px), np.where(good, 0.0, np.inf)
    for limits in (SMALL, SHADOWED):
        ids = np.flatnonzero(least > PLAIN_NOISE * corners.noise)
        if limits.is_shadowed:
            ids = ids[looks_shadowed(image, corners.board, sites.chosen(ids), corners.contrast)]
        if not len(ids):
            break
        again, shapes, noise = _fit(image, corners.board, sites.chosen(ids), starts[ids], limits, corners.noise)
        with np.errstate(invalid="ignore"):
            found = again.consistent & (2.0 * np.abs(shapes[:, CONTRAST]) > LEAST_CONTRAST * corners.contrast)
            found &= noise < least[ids]
        new = ids[found]
        points[new], covariance[new], good[new] = again.points_px[found], again.covariance_px2[found], True
        least[new] = noise[found]
    return sites, replace(corners, points_px=points, covariance_px2=covariance, consistent=good)


def _with_places_for(corners: Corners, more: int) -> Corners:
    """The corners and behind them so many that are not found."""
    return replace(
        corners,
        points_px=np.vstack((corners.points_px, np.full((more, 2), np.nan))),
        covariance_px2=np.concatenate((corners.covariance_px2, np.full((more, 2, 2), np.nan))),
        consistent=np.append(corners.consistent, np.zeros(more, bool)),
    )


def _next_shapes(corners: Corners, shapes: Array, board: BoardMap, at: Array) -> Array:
    """What the next pass starts from."""
    good, out = corners.consistent, _start_shapes(board, at, corners.blur_px)
    out[good, :2] = corners.points_px[good] - board(at)[good]
    out[good, MEAN:] = shapes[good, MEAN:]
    return out


def _start_shapes(board: BoardMap, at: Array, blur_px: float) -> Array:
    shapes = np.full((len(at), SHAPE), np.nan)
    shapes[:, :2] = 0.0
    shapes[:, 2:4] = normal_angles(board.jacobian(at))
    shapes[:, BLUR] = blur_px
    shapes[:, SLOPE:] = 0.0
    shapes[:, MEAN] = np.nan
    return shapes


def _fit(
    image: Light, board: BoardMap, sites: CornerSites, shapes: Array, limits: _Pass, usual: float | None = None
) -> tuple[Corners, Array, Array]:
    """One pass over all corners, their shapes and noise; consistent is what converged to a corner of the right sense.

    usual: noise of the board's other corners, where there are any.
    """
    at = sites.at
    jacobian = board.jacobian(at)
    task = _task(board, jacobian, sites, shapes, limits)
    if limits.is_shadowed:
        fitted, covariance, noise, converged = fit_shadowed(image, task, STOP)
    else:
        fitted, covariance, noise, converged = fit_corners(image, task, limits.steps, STOP)
    good = _is_corner(fitted, covariance, task.starts, jacobian, sites)
    with np.errstate(invalid="ignore"):
        usual = float(np.nanmedian(noise)) if usual is None and np.any(good) else usual
        most = PLAIN_NOISE if limits.is_shadowed else MOST_NOISE
        good &= noise <= most * usual if usual is not None else True
    good &= converged if limits.must_converge else True
    points = fitted[:, :2]
    if not np.any(good):
        return Corners(points, covariance, good, np.nan, np.nan, board), fitted, noise
    covariance *= _stated_noise(noise, good)[:, None, None]
    blur, contrast = np.median(fitted[good, BLUR]), 2.0 * np.median(np.abs(fitted[good, CONTRAST]))
    typical = float(np.median(noise[good]))
    return Corners(points, covariance, good, float(blur), float(contrast), board, typical), fitted, noise


def _stated_noise(noise: Array, good: Mask) -> Array:
    """(n,) variance of the noise that is stated for each corner, grey levels^2.

    A corner's own few pixels tell its noise to a tenth; weights that scatter so much would promise too much. But where
    they show far more than the board's, it is what the model does not explain there.
    """
    return np.maximum(OWN_NOISE * noise + (1.0 - OWN_NOISE) * np.median(noise[good]), SURE_NOISE * noise)


def _task(board: BoardMap, jacobian: Array, sites: CornerSites, shapes: Array, limits: _Pass) -> CornerTask:
    """Where each corner is looked for, and in which pixels: up to the next edges, and not beside the circle."""
    at = sites.at
    lengths = np.linalg.norm(jacobian, axis=1)
    blur = shapes[:, BLUR]
    discs, disc_axes = ellipses_around_circle(board, sites.circled, float(np.median(blur)))
    blurs = CLEAR_BLURS * blur[:, None] / lengths
    if limits.is_shadowed:
        windows = np.clip(SHADOW_BLURS * blur, SHADOW_PX, FARTHEST_SHADOW_PX)
        bands, sharp = np.full(len(at), np.inf), np.zeros(len(at), bool)
    elif limits.reach > 0.0:
        windows = _final_windows(sites, jacobian, limits)
        bands, sharp = BAND_PX + BAND_BLURS * blur, blur < SHARP_PX
    else:
        windows = np.maximum(NEAR_PX, NEAR_BLURS * blur)
        bands, sharp = np.full(len(at), np.inf), np.zeros(len(at), bool)
    edges = board.edge_forms(at, jacobian, windows)
    if limits.moves is not None:
        edges[..., 0] += limits.moves.bends(board(at)[:, 1] + shapes[:, 1], jacobian)
    return CornerTask(
        starts=board(at),
        shapes=shapes,
        edges=edges,
        sharp=sharp,
        inverses=np.linalg.inv(jacobian),
        reaches=np.clip(sites.next_edge - blurs, sites.least_reach, sites.reach),
        clears=np.maximum(sites.clear - blurs.max(axis=1), LEAST_CLEAR * sites.clear),
        windows=np.ceil(windows).astype(np.int64),
        bands=bands,
        discs=discs,
        disc_axes=disc_axes,
    )


def _final_windows(sites: CornerSites, jacobian: Array, limits: _Pass) -> Array:
    """(n,) px along the edges that each corner's fit uses at most."""
    reach = min(sites.reach, limits.reach)
    return np.clip(reach * np.linalg.norm(jacobian, axis=1).max(axis=1), FINAL_PX, FARTHEST_PX)


def _is_corner(fitted: Array, covariance: Array, starts: Array, jacobian: Array, sites: CornerSites) -> Mask:
    """(n,) which fits have a covariance, and found a corner of the right sense near where it was looked for."""
    with np.errstate(invalid="ignore", over="ignore"):
        side = np.sqrt(np.abs(np.linalg.det(jacobian)))
        good = np.linalg.norm(fitted[:, :2] - starts, axis=1) <= START_LIMIT * side
        good &= fitted[:, CONTRAST] * sites.sense > 0.0
        return good & np.all(np.isfinite(covariance), axis=(1, 2)) & (np.linalg.det(covariance) > 0.0)
