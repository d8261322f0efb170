"""Every corner of a board fitted to the picture, from a first map: to a fraction of a pixel, with its covariance."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap, normal_angles
from pipelines.detection.circle_surroundings import ellipses_around_circle
from pipelines.detection.consistency import Corners, drop_inconsistent
from pipelines.detection.corner_model import fit_corners
from pipelines.detection.corner_picture import BLUR, CONTRAST, MEAN, SHAPE, SLOPE, CornerTask
from pipelines.detection.corner_sites import CornerSites
from pipelines.detection.finders import Grey

STOP = 0.5  # step, in standard deviations, at which a fit has converged; it is still made
START_BLUR_PX = 0.8
LEAST_CLEAR = 0.5  # of a place's own `clear`, however blurred the print beyond is
CLEAR_BLURS = 2.6  # blurs to keep between a fit's pixels and the next edge
START_LIMIT = 0.3  # of the local square: a fit that moves further has gone to another corner
OWN_NOISE = 0.33  # share of a corner's own noise in what is stated for it; the rest is the board's median


class _Pass(NamedTuple):
    """Limits of one fit of every corner."""

    window_px: int  # half side of the pixels that it may use
    steps: int
    must_converge: bool


NEAR = _Pass(window_px=5, steps=5, must_converge=False)  # enough for a map to start the final one from
FINAL = _Pass(window_px=10, steps=12, must_converge=True)


def refine_corners(image: Grey, board: BoardMap, sites: CornerSites) -> Corners:
    """Fit every corner near where `board` puts it, clear of the circle: once near by, then over the whole window."""
    at, size = sites.at, (image.shape[1], image.shape[0])
    near, found = _fit(image, board, sites, _start_shapes(board, at, START_BLUR_PX), NEAR)
    good = near.consistent
    if np.mean(~good) > 0.5:
        return near
    board = BoardMap.fit(at, near.points_px, size, good * 1.0, board)
    shapes = _start_shapes(board, at, near.blur_px)
    shapes[good, :2] = near.points_px[good] - board(at)[good]
    shapes[good, MEAN:] = found[good, MEAN:]
    return drop_inconsistent(_fit(image, board, sites, shapes, FINAL)[0], at, size)


def _start_shapes(board: BoardMap, at: Array, blur_px: float) -> Array:
    shapes = np.full((len(at), SHAPE), np.nan)
    shapes[:, :2] = 0.0
    shapes[:, 2:4] = normal_angles(board.jacobian(at))
    shapes[:, BLUR] = blur_px
    shapes[:, SLOPE:] = 0.0
    shapes[:, MEAN] = np.nan
    return shapes


def _fit(image: Grey, board: BoardMap, sites: CornerSites, shapes: Array, limits: _Pass) -> tuple[Corners, Array]:
    """One pass over all corners, and their shapes; consistent is what converged to a corner of the right sense."""
    at = sites.at
    jacobian = board.jacobian(at)
    task = _task(board, jacobian, sites, shapes, limits.window_px)
    fitted, covariance, noise, converged = fit_corners(image, task, limits.steps, STOP)
    good = _is_corner(fitted, covariance, task.starts, jacobian, sites)
    good &= converged if limits.must_converge else True
    points = fitted[:, :2]
    if not np.any(good):
        return Corners(points, covariance, good, np.nan, np.nan, board), fitted
    # A corner's own few pixels tell its noise to a tenth; weights that scatter so much would promise too much.
    covariance *= (OWN_NOISE * noise + (1.0 - OWN_NOISE) * np.median(noise[good]))[:, None, None]
    blur, contrast = np.median(fitted[good, BLUR]), 2.0 * np.median(np.abs(fitted[good, CONTRAST]))
    return Corners(points, covariance, good, float(blur), float(contrast), board), fitted


def _task(board: BoardMap, jacobian: Array, sites: CornerSites, shapes: Array, window: int) -> CornerTask:
    """Where each corner is looked for, and in which pixels: up to the next edges, and not beside the circle."""
    at = sites.at
    lengths = np.linalg.norm(jacobian, axis=1)
    discs, disc_axes = _covered(board, sites)
    blurs = CLEAR_BLURS * shapes[:, BLUR, None] / lengths
    return CornerTask(
        starts=board(at),
        shapes=shapes,
        bends=board.curvatures(at, jacobian),
        inverses=np.linalg.inv(jacobian),
        reaches=np.clip(sites.next_edge - blurs, sites.least_reach, sites.reach),
        clears=np.maximum(sites.clear - blurs.max(axis=1), LEAST_CLEAR * sites.clear),
        window=window,
        discs=discs,
        disc_axes=disc_axes,
    )


def _is_corner(fitted: Array, covariance: Array, starts: Array, jacobian: Array, sites: CornerSites) -> Mask:
    """(n,) which fits have a covariance, and found a corner of the right sense near where it was looked for."""
    with np.errstate(invalid="ignore"):
        side = np.sqrt(np.abs(np.linalg.det(jacobian)))
        good = np.linalg.norm(fitted[:, :2] - starts, axis=1) <= START_LIMIT * side
        good &= fitted[:, CONTRAST] * sites.sense > 0.0
        return good & np.all(np.isfinite(covariance), axis=(1, 2)) & (np.linalg.det(covariance) > 0.0)


def _covered(board: BoardMap, sites: CornerSites) -> tuple[Array, Array]:
    """Ellipses (k, 2) px that no fit may use, and the map (2, 2) from px to the unit circle of one."""
    if sites.circled is None:
        return np.empty((0, 2)), np.eye(2)
    return ellipses_around_circle(board, sites.circled)
