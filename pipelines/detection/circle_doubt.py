"""What a circle's stated error holds beyond that of its fit: errors of which the residuals show little."""

from __future__ import annotations

import math

import numpy as np

from eposit.arrays import Array

OFF_SHARE = 0.015  # of how far it lies off: a map of the wrong kind there has the circle's form a little wrong, too
MISFIT_SHARE = 0.05  # of the map's misfit, by which a bent sheet moves it
CORNERS_SHARE = 0.13  # of the corners' stated error that a circle has at least: what moves them moves it
# px^1.5, over the root of the radius: by which a fit's fine grid moves a circle; the edge of a larger one crosses more
# cells. Fits on 2, 3, 4 and 6 cells to a pixel differ by 0.001 px at 15 px.
GRID = 0.004
USUALLY_BEYOND_PX = 0.1  # by which edges differ from those of a gaussian blur in ordinary pictures, defocus included
WIDTH_ERRORS = 6.0  # corners' stated errors by which noise alone makes edges differ from it
BEYOND_SHARE, APART_SHARE = 0.085, 0.3  # of what they differ by more, and along one axis more than along the other, by
# which a circle may be off: its shade looks like what sharpening and motion leave beside an edge
ODD_SHARE = 0.25  # of how far the corners' edges seem to be moved, by which a circle may be, as its contrast differs
ODD = 2.0, 4.0  # times the variance that the circle's fit leaves: up to the first the two may differ by chance, and
# what corners show beyond the second lies at their tips alone
SCATTERED = 0.6  # of the scatter that the corners' residuals promise, see `corner_scatter`: with less, these are
# the same at all corners, as print and clipped white, and move none of them
PER_SLOPE = math.sqrt(2.0 * math.pi)  # blurs over which an edge's steepest part would rise from black to white
USUAL_SIZE = 0.0005  # by which a fit that explains the picture finds another size than the map's
SURE_SIZE = 0.5  # deviations of the map's size that also say nothing
SHARPENED_SHARE = 0.15  # of what edges are narrower or wider, by which sharpening shifts a rim all around
RESIZED = 1.8  # times as far as the fit would move at the map's size, what made the size wrong may move the place


def moved_edges(noise: float, left: float, scatter: float, contrast: float, blur_px: float) -> float:
    """Px by which edges seem to be moved whose form is none of a blur: filters that keep edges and others make such.

    noise, left: variances that the fits of corners leave, NaN if not known, and of the circle, grey values^2.
    scatter: of the corners, see `corner_scatter`. contrast: of white and black, grey values.
    """
    usual, most = ODD
    if scatter < SCATTERED or not noise > usual * left:
        return 0.0
    return PER_SLOPE * blur_px * math.sqrt(min(noise, most * left) - usual * left) / contrast


def beyond_the_fit(
    off: Array, corners: Array, beyond: tuple[float, float], misfit: float, odd: float, radius_px: float
) -> Array:
    """(2, 2) px^2 to be added to the covariance of a fit.

    off: (2,) px from where the board predicts the circle. corners: (2, 2) px^2, of a corner. beyond: px by which the
    edges along x and y are wider than those of a gaussian blur. misfit: of the map, px. odd: px, see `moved_edges`.
    radius_px: of the circle.
    """
    along_x, along_y = beyond
    usual = max(USUALLY_BEYOND_PX, WIDTH_ERRORS * math.sqrt(0.5 * np.trace(corners)))
    wide = max(abs(along_x), abs(along_y), usual) - usual
    apart = max(abs(along_x - along_y), usual) - usual
    variance = (
        GRID**2 / radius_px + OFF_SHARE**2 * (off @ off) + (BEYOND_SHARE * wide) ** 2 + (APART_SHARE * apart) ** 2
    )
    variance += (MISFIT_SHARE * misfit) ** 2 + (ODD_SHARE * odd) ** 2
    return variance * np.eye(2) + CORNERS_SHARE**2 * corners


def unexplained_size(size: float, sure: float, beyond: float) -> float:
    """How much of a size, as a share off the map's, neither the map's own error nor a sharpened rim explains.

    sure: standard deviation of the map's size, as a share. beyond: by how much edges are narrower or wider than those
    of a gaussian blur, radii.
    """
    return max(abs(size) - USUAL_SIZE - SURE_SIZE * sure - SHARPENED_SHARE * beyond, 0.0)


def at_least(covariance: Array, resized: Array) -> Array:
    """(2, 2) px^2: a covariance that holds, along the way that a circle would move at the map's size, that way.

    The board's map gives the size far better than an unexplained picture does: a rim that lies elsewhere because of
    a shadow of another form, a filter or a thin print shows in the size, and moves the place, on one side of the disc,
    by as much.

    covariance: (2, 2) px^2. resized: (2,) px by which the place would move.
    """
    far = float(resized @ resized)
    if far <= 0.0:
        return covariance
    lacking = RESIZED**2 * far - float(resized @ covariance @ resized) / far
    return covariance + max(lacking, 0.0) / far * np.outer(resized, resized)
