"""Dark blobs in a picture that may be the discs of a grid, at most so many, whatever the picture holds.

OpenCV's blob detector takes time as the pixels, and its search of a grid as the cube of the blobs: 12 s for 800. So
large pictures are reduced, and of too many blobs only those are kept that have neighbours as the discs of the grid do.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from eposit.arrays import Array
from pipelines.detection.grey_picture import Grey

MOST_PIXELS = 1.2e6  # of the picture in which blobs are looked for; a larger one is reduced
MOST_BLOBS = 300  # that are given to OpenCV's search, or as many as the grid has discs
LEAST_AREA_PX = 12.0
NEIGHBOURS = 8  # nearest blobs among which a blob's neighbours are
NEAR = (0.35, 1.6)  # distance of neighbours over what the grid says for discs of that size; a tilt shortens it
ALIKE = 1.6  # most ratio of neighbours' sizes
LEAST_NEIGHBOURS = 2


class Blobs(NamedTuple):
    """n dark blobs."""

    points: Array  # (n, 2) px
    sizes: Array  # (n,) diameters, px


def find_blobs(image: Grey) -> Blobs:
    """The blobs of a picture (height, width)."""
    scale = int(np.ceil(np.sqrt(image.size / MOST_PIXELS)))
    height, width = (size // scale for size in image.shape)
    level = image[: height * scale, : width * scale]
    if scale > 1:
        level = np.asarray(cv2.resize(level, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
    parameters = cv2.SimpleBlobDetector.Params()
    parameters.minArea, parameters.maxArea = LEAST_AREA_PX, level.size / 4.0
    parameters.minDistBetweenBlobs = np.sqrt(LEAST_AREA_PX)
    found = cv2.SimpleBlobDetector.create(parameters).detect(np.ascontiguousarray(level))
    points = np.array([blob.pt for blob in found]).reshape(-1, 2)
    return Blobs((points + 0.5) * scale - 0.5, np.array([blob.size for blob in found]) * scale)


def likely_discs(blobs: Blobs, count: int, distance: float) -> Array:
    """(n, 2) px of the blobs that may be a grid's discs, at most as many as can be searched; none if there are more.

    count: of the grid's discs. distance: of neighbouring discs, in diameters.
    """
    most = max(MOST_BLOBS, count)
    if len(blobs.points) <= most:
        return blobs.points
    group = _groups(blobs, distance)
    sizes = np.bincount(group)
    fits = np.flatnonzero((sizes >= count) & (sizes <= most))
    return blobs.points[group == fits[np.argmin(sizes[fits])]] if len(fits) else np.empty((0, 2))


def _groups(blobs: Blobs, distance: float) -> NDArray[np.int32]:
    """(n,) number of the group of each blob: neighbours are in one, and a blob without enough of them is alone."""
    n = len(blobs.points)
    far, other = (np.asarray(part)[:, 1:] for part in cKDTree(blobs.points).query(blobs.points, k=NEIGHBOURS + 1))
    own, size = np.repeat(np.arange(n)[:, None], NEIGHBOURS, axis=1), blobs.sizes[:, None]
    ratio = far / (distance * size)
    near = (ratio > NEAR[0]) & (ratio < NEAR[1])
    near &= (blobs.sizes[other] < ALIKE * size) & (size < ALIKE * blobs.sizes[other])
    enough = near.sum(axis=1) >= LEAST_NEIGHBOURS
    near &= enough[:, None] & enough[other]
    links = coo_array((np.ones(int(near.sum())), (own[near], other[near])), shape=(n, n))
    return np.asarray(connected_components(links, directed=False)[1])
