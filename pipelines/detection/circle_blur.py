"""How the circle's edges are blurred: a gaussian, and the streak of a straight motion in any direction.

The edges of a board run in two directions, and their widths alone tell of motion along them only: along a diagonal both
are wider by as much. What is moved along a diagonal shows in the middle of the corners: where it runs over the two
black squares, the corner is darker than between black and white, where it runs over the white ones it is lighter, and
from each corner to its neighbour these change places. (A print whose black squares are a little larger darkens all
corners.)
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap
from pipelines.detection.circle_doubt import USUALLY_BEYOND_PX
from pipelines.detection.consistency import Corners
from pipelines.detection.corner_blur import LIMITS_PX, SAMPLING, Picture, edge_profiles, profile_widths
from pipelines.detection.corner_sites import CornerSites

LEAST_STREAK_PX = 2.0  # shorter ones change edges as little as noise and filters do; pictures without motion show 1.4
LEAST_SHARE = 0.25  # of the variance of the edges that it widens most, which a motion must make: in a blurred picture
# noise shows a longer one
BOX = 36.0 / math.pi  # square of a box's width over the variance of a gaussian with the same integral of q (1 - q)
LEAST_CONTRAST = 0.5  # of the median one: what the squares about a corner must have
ROUNDS = 6  # of least squares with weights that make it one of absolute distances
LEAST_VARIANCE = 0.05  # px^2, of an edge
PRINT_BEYOND_PX = 0.025  # by which edges are narrower than those of a gaussian blur where it is print that runs


class Blur(NamedTuple):
    """The blur of an edge."""

    px: float  # standard deviation of a gaussian, the pixels' own area included
    streak: Array  # (2,) px from end to end of the motion; zero where it stands still

    def reach(self, ways: Array) -> Array:
        """(k,) standard deviations along ways (k, 2), times these ways' lengths."""
        box = ways @ self.streak
        return np.sqrt(self.px**2 * np.sum(ways**2, axis=1) + box**2 / 12.0)

    def scaled(self, share: float) -> Blur:
        """A picture's that is smaller or sharper by a share."""
        return Blur(share * self.px, share * self.streak)

    def in_means(self, by: int) -> Blur:
        """In a picture of the means of `by` x `by` pixels, whose centres spread over an area of that size."""
        return Blur(math.sqrt(self.px**2 + (by**2 - 1) / 12.0), self.streak).scaled(1.0 / by)


def still(blur_px: float) -> Blur:
    """Without motion."""
    return Blur(blur_px, np.zeros(2))


def edge_blur(corners: Corners) -> float:
    """Px. Where black squares grew in print and meet at the corners, these look more blurred than the edges are."""
    beyond = float(np.mean(corners.widths_beyond_px))
    if not -USUALLY_BEYOND_PX < beyond < -PRINT_BEYOND_PX:
        return corners.blur_px
    width = math.sqrt(corners.blur_px**2 + SAMPLING) + beyond
    return min(corners.blur_px, math.sqrt(max(width**2 - SAMPLING, LIMITS_PX[0] ** 2)))


def motion_blur(image: Picture, board: BoardMap, sites: CornerSites) -> Blur | None:
    """The blur of a picture that moved in a straight line while it was taken; None if it did not, or hardly.

    sites: of corners that were found.
    """
    told = _edges(image, board, sites) if len(sites.at) else None
    if told is None:
        return None
    edges, variances = told
    crossings, levels, sense = _middles(image, board, sites)
    if np.all(sense > 0.0) or np.all(sense < 0.0):
        return None
    weights = np.concatenate([np.full(len(variances), 1.0 / len(variances)), _even(sense)])
    spread = np.array([np.median(variances), 0.0, np.median(variances)])  # xx, xy and yy of the blur, px^2
    for _ in range(ROUNDS):
        product = np.prod([np.maximum(_squares(way, way) @ spread, LEAST_VARIANCE) for way in crossings], axis=0)
        # Of a gaussian, whose two coordinates have the same sign as often as their correlation's arc sine says.
        across = np.sin(0.5 * np.pi * np.clip(levels, -1.0, 1.0)) * np.sqrt(product)
        rows, found = np.vstack((edges, _squares(*crossings))), np.append(variances, across)
        off = np.abs(rows @ spread - found)
        root = np.sqrt(weights / np.maximum(off, max(np.median(off), 1e-9)))
        spread = np.linalg.lstsq(rows * root[:, None], found * root, rcond=None)[0]
    return _moved(spread)


def _moved(spread: Array) -> Blur | None:
    """A gaussian and a streak with a spread (3,) xx, xy and yy, px^2; None if the streak is short."""
    (least, most), axes = np.linalg.eigh(spread[[[0, 1], [1, 2]]])
    length = math.sqrt(BOX * (most - least))
    if length < LEAST_STREAK_PX or most - least < LEAST_SHARE * most:
        return None
    return Blur(math.sqrt(max(float(least) - SAMPLING, LIMITS_PX[0] ** 2)), length * axes[:, 1])


def _edges(image: Picture, board: BoardMap, sites: CornerSites) -> tuple[Array, Array] | None:
    """(k, 3) what xx, xy and yy are multiplied by in the variance of edges, and (k,) these variances, px^2."""
    profiles = edge_profiles(image, board, sites)
    if profiles is None:
        return None
    widths = profile_widths(profiles)
    normals = _normals(board, profiles.at)
    across = normals[np.where(profiles.along_y, 0, 1), np.arange(len(widths))]
    return _squares(across, across), widths * np.abs(widths)


def _middles(image: Picture, board: BoardMap, sites: CornerSites) -> tuple[Array, Array, Array]:
    """Normals (2, m, 2) of the edges at corners, how light (m,) their middles are, and how the squares about them lie.

    A middle is 1 where it is as light as the squares at lower x and y and at higher x and y, and -1 where as the other
    two; the last is the contrast of these, (m,) grey values.
    """
    ways = np.array([(0.0, 0.0), (0.5, 0.5), (-0.5, -0.5), (0.5, -0.5), (-0.5, 0.5)])
    x, y = np.moveaxis(board((sites.at + ways[:, None]).reshape(-1, 2)).reshape(5, -1, 2), -1, 0).astype(np.float32)
    grey = cv2.remap(image, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE).astype(np.float64)
    contrast = 0.5 * (grey[1] + grey[2] - grey[3] - grey[4])
    clear = np.abs(contrast) > LEAST_CONTRAST * np.median(np.abs(contrast))
    levels = 2.0 * (grey[0] - grey[1:].mean(axis=0))[clear] / contrast[clear]
    return _normals(board, sites.at[clear]), levels, contrast[clear]


def _normals(board: BoardMap, at: Array) -> Array:
    """(2, m, 2) unit normals of the edges along y and of those along x, at places (m, 2)."""
    inverse = np.linalg.inv(board.jacobian(at))
    return np.moveaxis(inverse / np.linalg.norm(inverse, axis=2, keepdims=True), 1, 0)


def _squares(one: Array, other: Array) -> Array:
    """(m, 3) what xx, xy and yy are multiplied by in the covariance along ways (m, 2) and (m, 2)."""
    (a, b), (c, d) = one.T, other.T
    return np.stack((a * c, a * d + b * c, b * d), axis=1)


def _even(sense: Array) -> Array:
    """(m,) weights, of sum 1, with which the corners of either sign weigh as much."""
    light = sense > 0.0
    return 0.5 * np.where(light, 1.0 / max(np.sum(light), 1), 1.0 / max(np.sum(~light), 1))
