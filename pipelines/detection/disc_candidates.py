"""Dark blobs in a picture that may be the discs of a grid, at most so many, whatever the picture holds.

A blob is what is darker than the mean of its surroundings, in one piece and of about the size that a level of the
picture is looked at for: the others show in the picture reduced.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull, cKDTree

from eposit.arrays import Array
from pipelines.detection.grey_picture import Grey

MOST_PIXELS = 2.5e7  # of the finest level: a larger picture is reduced first
LEAST_PICTURE_PX = 16
LEAST_LEVEL_PX = 64  # side of the coarsest level, or the picture's own
SMOOTHING_PX = 0.8  # of a level: noise makes no holes and no specks
AROUND_PX = 41  # side of the square that a pixel is compared with
LEAST_DEPTH, LEAST_SHARE = 5, 0.4  # of a dark pixel below its mean: grey values, and of what the darkest there has
BLOCK_PX, BLOCKS = 8, 5  # side of a block whose darkest pixel is taken, and of the square of blocks
LEAST_AREA_PX, MOST_SIDE_PX = 6, 40
FILLED = (0.3, 0.95)  # of the upright rectangle around it: a slanted ellipse has little, a disc 0.79
SMALL_PX = 6  # longer side of one that may be a whole rectangle of pixels
MOST_OBLONG = 4.0  # longer over shorter side of that rectangle
MOST_BLOBS = 20_000  # of a level among which a grid is looked for, the darkest for their surroundings
NEIGHBOURS = 8  # nearest blobs among which a blob's neighbours are
NEAR = (0.25, 2.0)  # distance of neighbours over what the grid says for discs of that size; a tilt changes both
ALIKE = 1.7  # most ratio of neighbours' sizes


class Blobs(NamedTuple):
    """n dark blobs."""

    points: Array  # (n, 2) px
    sizes: Array  # (n,) diameters of discs of their areas, px
    searched: int  # number of those that a grid is looked for among: the first

    def inside(self, discs: Array) -> int:
        """Number of the blobs of discs' size within the outlines of discs (k, 2) px."""
        outline = discs[ConvexHull(discs).vertices]  # in the direction in which x turns to y
        along = np.roll(outline, -1, axis=0) - outline
        away = self.points[:, None] - outline
        within = np.all(along[:, 0] * away[..., 1] - along[:, 1] * away[..., 0] >= -1e-6, axis=1)
        size = np.median(self.sizes[np.asarray(cKDTree(self.points).query(discs)[1])])
        return int(np.sum(within & (self.sizes < ALIKE * size) & (size < ALIKE * self.sizes)))


def levels_of_blobs(image: Grey) -> Iterator[Blobs]:
    """The blobs of a picture (height, width), from the largest to the smallest; the first ones are the darkest."""
    if min(image.shape) < LEAST_PICTURE_PX:
        return
    finest = int(np.ceil(np.sqrt(image.size / MOST_PIXELS)))
    scale = finest
    while min(image.shape) // (2 * scale) >= LEAST_LEVEL_PX:
        scale *= 2
    while scale >= finest:
        yield _find_blobs(image, scale)
        scale //= 2


def _find_blobs(image: Grey, scale: int) -> Blobs:
    """The blobs of the picture reduced by a whole number."""
    height, width = (size // scale for size in image.shape)
    level = image[: height * scale, : width * scale]
    if scale > 1:
        level = np.asarray(cv2.resize(level, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
    level = cv2.GaussianBlur(level, (0, 0), SMOOTHING_PX)
    depth = np.asarray(cv2.subtract(cv2.boxFilter(level, -1, (AROUND_PX, AROUND_PX)), level), np.uint8)
    mask = cv2.compare(depth, _least_depth(depth), cv2.CMP_GT)
    count, _, stats, centroids = cv2.connectedComponentsWithStats(mask, connectivity=4, ltype=cv2.CV_32S)
    if count < 2:
        return Blobs(np.empty((0, 2)), np.empty(0), 0)
    good = np.flatnonzero(_look_like_discs(stats[1:])) + 1  # the first is what is not dark
    points, areas = centroids[good], stats[good, cv2.CC_STAT_AREA]
    if len(good) > MOST_BLOBS:
        column, row = np.rint(points).astype(int).T
        darkest = np.argsort(-depth[row, column].astype(int), kind="stable")
        points, areas = points[darkest], areas[darkest]
    return Blobs((points + 0.5) * scale - 0.5, 2.0 * np.sqrt(areas / np.pi) * scale, min(len(good), MOST_BLOBS))


def _least_depth(depth: Grey) -> Grey:
    """How dark each pixel must be: a share of what the darkest around it has, so that discs side by side stay apart."""
    middles = slice(BLOCK_PX // 2, None, BLOCK_PX)
    blocks = cv2.dilate(depth, np.ones((BLOCK_PX, BLOCK_PX), np.uint8))[middles, middles]
    most = cv2.dilate(np.ascontiguousarray(blocks), np.ones((BLOCKS, BLOCKS), np.uint8))
    least = np.maximum(np.rint(LEAST_SHARE * np.asarray(most, np.float32)), LEAST_DEPTH - 1.0).astype(np.uint8)
    return np.asarray(cv2.resize(least, depth.shape[::-1], interpolation=cv2.INTER_LINEAR), np.uint8)


def _look_like_discs(stats: NDArray[Any]) -> NDArray[np.bool_]:
    """(n,) which pieces have the area and the outlines of a disc that is seen from some side."""
    width, height, area = (
        stats[:, k].astype(np.float64) for k in (cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT, cv2.CC_STAT_AREA)
    )
    longer, shorter, filled = np.maximum(width, height), np.minimum(width, height), area / (width * height)
    good = (area >= LEAST_AREA_PX) & (longer <= MOST_SIDE_PX) & (longer <= MOST_OBLONG * shorter)
    return good & (filled > FILLED[0]) & ((filled < FILLED[1]) | (longer <= SMALL_PX))


def groups_of_blobs(blobs: Blobs, distance: float, least: int) -> list[Array]:
    """Blobs (n, 2) px that are joined by neighbours, of at least so many, the smaller groups first.

    distance: of a grid's neighbouring discs, in diameters.
    """
    n, points, sizes = blobs.searched, blobs.points[: blobs.searched], blobs.sizes[: blobs.searched]
    if n < max(least, NEIGHBOURS + 1):
        return [points] if least <= n else []
    far, other = (np.asarray(part)[:, 1:] for part in cKDTree(points).query(points, k=NEIGHBOURS + 1))
    own, size = np.repeat(np.arange(n)[:, None], NEIGHBOURS, axis=1), sizes[:, None]
    ratio = far / (distance * size)
    near = (ratio > NEAR[0]) & (ratio < NEAR[1])
    near &= (sizes[other] < ALIKE * size) & (size < ALIKE * sizes[other])
    links = coo_array((np.ones(int(near.sum())), (own[near], other[near])), shape=(n, n))
    group = np.asarray(connected_components(links, directed=False)[1])
    members = np.bincount(group)
    fits = np.flatnonzero(members >= least)
    return [points[group == k] for k in fits[np.argsort(members[fits], kind="stable")]]
