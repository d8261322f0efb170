"""Grids of discs in an image: found by OpenCV, placed by us.

A disc's darkness is summed over the pixels around it; their centroid is that of the disc's image, whatever the blur,
as a point spread only spreads it. The centroid of a projected disc is not the projection of its centre: by how much it
is off follows from the map from board to image, which is fitted to the centres.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from scipy.spatial import cKDTree

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap
from pipelines.detection.consistency import Corners, drop_inconsistent
from pipelines.detection.disc_candidates import MOST_BLOBS, find_blobs, likely_discs
from pipelines.detection.finders import Grey, textured_region
from pipelines.detection.seen_points import SeenPoints
from render.targets.circle_grid import CircleGrid

DOT_SCALE, DOT_PIXELS = 2.0, 5e6  # pixels of the picture of dots to one of the picture, and of the whole, at most
DOT_REACH, DOT_MARGIN = 2, 20.0  # px of a dot to each side, and of the picture around the dots
CLUSTERING = cv2.CALIB_CB_CLUSTERING
ROUNDS = 3  # of a map through the centres, and centres through the map
RIM_STEPS = 64
CLEAR = 0.92  # of the way to the next disc's rim that a disc's window may reach
LEAST_WHITE = 12  # pixels of the window that see white alone
LEAST_NOISE = 1.0 / 12.0  # variance of rounding, grey levels^2
START_LIMIT = 0.25  # spacings that a centroid may lie from where the map puts it


def find_circle_grid(image: Grey, target: CircleGrid) -> SeenPoints | None:
    """The centres of all discs in the target's order, as OpenCV sees them; None if it does not see the whole grid."""
    region = textured_region(image)
    blobs = find_blobs(np.ascontiguousarray(image[region.pixels]))
    count, size = target.columns * target.rows, (target.columns, target.rows)
    points = likely_discs(blobs, count, _nearest(target.pattern_points) / target.diameter_mm)
    if len(points) < count:
        return None
    drawn, first_px, scale = _dots(points)
    shape = cv2.CALIB_CB_ASYMMETRIC_GRID if target.asymmetric else cv2.CALIB_CB_SYMMETRIC_GRID
    searches = (shape, shape | CLUSTERING) if len(points) <= MOST_BLOBS else (shape | CLUSTERING,)
    for flags in searches:
        found, centres = cv2.findCirclesGrid(drawn, size, flags=flags, blobDetector=_dot_detector())
        if found:
            places = np.asarray(centres, np.float64).reshape(-1, 2) / scale + first_px
            grid = points[np.asarray(cKDTree(points).query(places)[1])].reshape(target.rows, target.columns, 2)
            ordered = _upright(grid, target).reshape(-1, 2) + [region.x, region.y]
            return SeenPoints(np.arange(len(ordered)), ordered, "circles")
    return None


def _dots(points: Array) -> tuple[Grey, Array, float]:
    """A picture of the points as black dots, where it begins, px, and its pixels to one.

    OpenCV's search of a grid takes a picture only, and finds its blobs anew: dots are found at once.
    """
    low, high = points.min(axis=0) - DOT_MARGIN, points.max(axis=0) + DOT_MARGIN
    scale = min(DOT_SCALE, float(np.sqrt(DOT_PIXELS / np.prod(high - low))))
    width, height = np.ceil((high - low) * scale).astype(int)
    drawn = np.full((height, width), 255, np.uint8)
    for x, y in np.rint((points - low) * scale).astype(int):
        drawn[y - DOT_REACH : y + DOT_REACH + 1, x - DOT_REACH : x + DOT_REACH + 1] = 0
    return drawn, low, scale


def _dot_detector() -> cv2.SimpleBlobDetector:
    parameters = cv2.SimpleBlobDetector.Params()
    parameters.minThreshold, parameters.maxThreshold, parameters.thresholdStep = 100.0, 200.0, 50.0
    parameters.minRepeatability, parameters.minDistBetweenBlobs = 1, 1.0
    parameters.filterByArea = parameters.filterByCircularity = parameters.filterByConvexity = False
    parameters.filterByInertia = False
    return cv2.SimpleBlobDetector.create(parameters)


def _upright(grid: Array, target: CircleGrid) -> Array:
    """Centres (rows, columns, 2) so that x to y turns as the image's axes do; x to the right where that is open."""
    if target.asymmetric and target.tells_orientation:
        return grid
    ways = [grid, grid[::-1, ::-1]]
    if grid.shape[0] == grid.shape[1] and not target.asymmetric:
        ways += [np.rot90(grid), np.rot90(grid, 3)]
    return max(ways, key=lambda way: float(_direction(way)[0]))


def _direction(grid: Array) -> Array:
    """(2,) unit vector of the image of the rows."""
    along = grid[:, -1].mean(axis=0) - grid[:, 0].mean(axis=0)
    return along / np.linalg.norm(along)


class _Blob(NamedTuple):
    """What a disc's window says; NaN where it says nothing."""

    centroid: Array  # (2,) px
    covariance: Array  # (2, 2) px^2
    contrast: float  # between white and the disc's middle, grey levels


def refine_circles(image: Grey, board: BoardMap, target: CircleGrid, unit_mm: float) -> Corners:
    """The projected centres of all discs, from a first map."""
    at, size = target.pattern_points / unit_mm, (image.shape[1], image.shape[0])
    radius = 0.5 * target.diameter_mm / unit_mm
    window = radius + CLEAR * (_nearest(at) - 2.0 * radius)
    if target.margin_mm < 0.5 * target.spacing_mm:
        window = min(window, radius + CLEAR * ((target.margin_mm + 0.5 * target.spacing_mm) / unit_mm - radius))
    blobs = [_blob(image, board, place, radius, 0.5 * (radius + window)) for place in at]
    centroids, covariance = np.stack([blob.centroid for blob in blobs]), np.stack([blob.covariance for blob in blobs])
    good = np.all(np.isfinite(centroids), axis=1)
    side = np.sqrt(np.abs(np.linalg.det(board.jacobian(at))))
    good[good] = np.linalg.norm(centroids - board(at), axis=1)[good] < START_LIMIT * side[good]
    nothing = Corners(centroids, covariance, good, float("nan"), float("nan"), board)
    if 2 * np.sum(good) <= board.slopes(at).shape[-1]:
        return Corners(centroids, covariance, np.zeros(len(at), bool), nothing.blur_px, nothing.contrast, board)
    weights, points = np.where(good, 1.0, 0.0), centroids
    for _ in range(ROUNDS):
        points = centroids + _centre_offsets(board, at, radius)
        board = BoardMap.fit(at, points, size, weights, board)
    contrast = float(np.median([blob.contrast for blob, use in zip(blobs, good, strict=True) if use]))
    covariance[~good] = np.eye(2)
    return drop_inconsistent(Corners(points, covariance, good, float("nan"), contrast, board), at, size)


def _nearest(at: Array) -> float:
    """The least distance between two places."""
    distance = np.linalg.norm(at[1:] - at[0], axis=1)
    return float(distance.min())


def _centre_offsets(board: BoardMap, at: Array, radius: float) -> Array:
    """(n, 2) px from the centroid of each disc's image to the image of its centre."""
    angle = np.arange(RIM_STEPS) * (2.0 * np.pi / RIM_STEPS)
    rim = radius * np.stack((np.cos(angle), np.sin(angle)), axis=1)
    places = (at[:, None] + rim).reshape(-1, 2)
    p = board(places).reshape(len(at), RIM_STEPS, 2)
    centre = board(at)
    p = p - centre[:, None]
    following = np.roll(p, -1, axis=1)
    cross = p[..., 0] * following[..., 1] - p[..., 1] * following[..., 0]
    return -np.einsum("ns,nsk->nk", cross, p + following) / (3.0 * cross.sum(axis=1))[:, None]


def _blob(image: Grey, board: BoardMap, place: Array, radius: float, window: float) -> _Blob:
    """Centroid of the darkness in a window about a disc. radius, window: in the board's unit."""
    none = _Blob(np.full(2, np.nan), np.full((2, 2), np.nan), float("nan"))
    centre, inverse = board(place), np.linalg.inv(board.jacobian(place))
    reach = window / np.linalg.norm(inverse, axis=1).min() if np.all(np.isfinite(inverse)) else np.inf
    extent = window * np.linalg.norm(np.linalg.inv(inverse), axis=1)
    low, high = np.floor(centre - extent).astype(int), np.ceil(centre + extent).astype(int) + 1
    if not np.isfinite(reach) or np.any(low < 0) or np.any(high > image.shape[::-1]):
        return none
    y, x = np.mgrid[low[1] : high[1], low[0] : high[0]]
    offset = np.stack((x.ravel(), y.ravel()), axis=1) - centre
    distance = np.linalg.norm(offset @ inverse.T, axis=1)
    used = distance < window
    offset, distance = offset[used], distance[used]
    grey = image[low[1] : high[1], low[0] : high[0]].ravel()[used].astype(np.float64)
    white = distance > 0.5 * (radius + window)
    if np.sum(white) < LEAST_WHITE:
        return none
    plane = np.column_stack((np.ones(len(offset)), offset))
    light = plane @ np.linalg.lstsq(plane[white], grey[white], rcond=None)[0]
    noise = max(float(np.mean((grey - light)[white] ** 2)), LEAST_NOISE)
    dark = 1.0 - grey / np.maximum(light, 1.0)
    total = dark.sum()
    middle = distance < 0.5 * radius
    if total <= 0.0 or not np.any(middle):
        return none
    mean = dark @ offset / total
    spread = (offset - mean) / np.maximum(light, 1.0)[:, None]
    return _Blob(centre + mean, noise * spread.T @ spread / total**2, float(np.median((light - grey)[middle])))
