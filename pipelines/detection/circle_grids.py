"""Grids of discs in an image.

A disc's darkness is summed over the pixels around it; their centroid is that of the disc's image, whatever the blur,
as a point spread only spreads it. The centroid of a projected disc is not the projection of its centre: by how much it
is off follows from the map from board to image, which is fitted to the centres.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
from scipy.spatial import cKDTree

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap
from pipelines.detection.consistency import Corners, drop_inconsistent
from pipelines.detection.disc_candidates import groups_of_blobs, levels_of_blobs
from pipelines.detection.disc_lattice import find_grid
from pipelines.detection.finders import Grey, textured_region
from pipelines.detection.next_map import next_map
from pipelines.detection.seen_points import SeenPoints
from pipelines.detection.time_limit import Check, unlimited
from render.targets.circle_grid import CircleGrid

MOST_PART = 0.5  # of the picture, for its textured region to be looked at before the whole
MOST_GROUPS = 12  # of a level's blobs that are looked at, the smallest that may hold the grid
WHITE_QUANTILE = 0.9  # of the grey values around a disc
LEAST_REACH_PX = 3.0
OPENCV_PIXELS, OPENCV_AREA_PX = 1.2e6, 12.0  # of the picture that OpenCV's blobs are looked for in, and of a blob
MOST_INSIDE = 1.25  # blobs within a grid's outline for each disc of it; among those of a texture there are many more
ROUNDS = 3  # of a map through the centres, and centres through the map
RIM_STEPS = 64
CLEAR = 0.92  # of the way to the next disc's rim that a disc's window may reach
LEAST_WHITE = 12  # pixels of the window that see white alone
MOST_UNEVEN = 0.35  # of the contrast: root mean square of that white; a black square's corners make it more
MOST_DARK = 0.25  # of the places between the discs; all are white, but for clutter before the board
LEAST_NOISE = 1.0 / 12.0  # variance of rounding, grey levels^2
START_LIMIT = 0.25  # spacings that a centroid may lie from where the map puts it


def find_circle_grid(image: Grey, target: CircleGrid, check_time: Check = unlimited) -> SeenPoints | None:
    """The centres of all discs in the target's order; None if not the whole grid is seen."""
    region = textured_region(image)
    part = image[region.pixels]
    for (x, y), picture in (((region.x, region.y), part), ((0, 0), image)):
        if picture is image or part.size < MOST_PART * image.size:
            ordered = _find_in(np.ascontiguousarray(picture), target, check_time)
            if ordered is not None:
                return SeenPoints(np.arange(len(ordered)), ordered + [x, y], "circles")
    return None


def _find_in(image: Grey, target: CircleGrid, check_time: Check) -> Array | None:
    """(n, 2) px of the discs as the first level shows them that shows all."""
    count, distance = target.columns * target.rows, _nearest(target.pattern_points) / target.diameter_mm
    for blobs in levels_of_blobs(image):
        check_time()
        for points in groups_of_blobs(blobs, distance, count)[:MOST_GROUPS]:
            check_time()
            ways = find_grid(points, target)
            if ways and blobs.inside(ways[0]) <= MOST_INSIDE * count:
                return _outline_centres(image, _upright(ways, target))
    return None


def _outline_centres(image: Grey, points: Array) -> Array:
    """(n, 2) px of discs moved to the centroids of what is dark in one piece there; as they are where nothing is."""
    moved = points.copy()
    for k, (point, (left, top, window)) in enumerate(zip(points, _windows(image, points), strict=True)):
        column, row = np.rint(point).astype(int) - (left, top)
        if not (0 < row < window.shape[0] and 0 < column < window.shape[1]):
            continue
        middle = 0.5 * (float(window[row, column]) + float(np.quantile(window, WHITE_QUANTILE)))
        _, labels, _, centroids = cv2.connectedComponentsWithStats(np.asarray(window < middle, np.uint8))
        piece = int(labels[row, column])
        if piece:
            moved[k] = centroids[piece] + (left, top)
    return moved


def opencv_centres(image: Grey, points: Array) -> Array:
    """(n, 2) px of discs as `cv2.SimpleBlobDetector` places them, reduced if it is large; NaN if not at all."""
    nearest = np.asarray(cKDTree(points).query(points, k=2)[0])[:, 1]
    low = np.maximum(points.min(axis=0) - nearest.max(), 0.0).astype(int)
    high = (points.max(axis=0) + nearest.max()).astype(int)
    part = image[low[1] : high[1], low[0] : high[0]]
    scale = int(np.ceil(np.sqrt(part.size / OPENCV_PIXELS)))
    width, height = part.shape[1] // scale, part.shape[0] // scale
    level = cv2.resize(part[: height * scale, : width * scale], (width, height), interpolation=cv2.INTER_AREA)
    parameters = cv2.SimpleBlobDetector.Params()
    parameters.minArea, parameters.maxArea = OPENCV_AREA_PX, level.size / 4.0
    parameters.minDistBetweenBlobs = np.sqrt(OPENCV_AREA_PX)
    found = cv2.SimpleBlobDetector.create(parameters).detect(np.asarray(level, np.uint8))
    centres = (np.array([blob.pt for blob in found]).reshape(-1, 2) + 0.5) * scale - 0.5 + low
    if not len(centres):
        return np.full(points.shape, np.nan)
    distance, which = (np.asarray(part) for part in cKDTree(centres).query(points))
    return np.where((distance < 0.5 * nearest)[:, None], centres[which], np.nan)


def _windows(image: Grey, points: Array) -> list[tuple[int, int, Grey]]:
    """Left, top and pixels of a square around each disc (n, 2) px, which reaches half the way to the nearest other."""
    nearest = np.asarray(cKDTree(points).query(points, k=2)[0])[:, 1]
    reach = np.maximum(0.5 * nearest, LEAST_REACH_PX)[:, None]
    low, high = np.maximum(np.floor(points - reach), 0.0).astype(int), np.ceil(points + reach).astype(int) + 1
    return [
        (left, top, np.ascontiguousarray(image[top:bottom, left:right]))
        for (left, top), (right, bottom) in zip(low.tolist(), high.tolist(), strict=True)
    ]


def _upright(ways: list[Array], target: CircleGrid) -> Array:
    """Of the ways in which the discs may be the target's that with x to the right in the picture."""
    return max(ways, key=lambda way: float(_direction(way.reshape(target.rows, target.columns, 2))[0]))


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
    first = _seen_through(image, board, at, radius, window)
    # A first map, through blobs, may be so far off that its windows cut discs.
    seen = _seen_through(image, first.board, at, radius, window)
    if not np.any(seen.consistent):
        return seen
    good = seen.consistent & _is_white_between(image, seen.board, at, seen.contrast)
    covariance = np.where(good[:, None, None], seen.covariance_px2, np.eye(2))
    return drop_inconsistent(replace(seen, covariance_px2=covariance, consistent=good), at, size)


def _seen_through(image: Grey, board: BoardMap, at: Array, radius: float, window: float) -> Corners:
    """The centres of the discs in windows that a map places, and the map through them.

    None is consistent if they are too few. radius, window: in the board's unit.
    """
    size = (image.shape[1], image.shape[0])
    blobs = [_blob(image, board, place, radius, 0.5 * (radius + window)) for place in at]
    centroids, covariance = np.stack([blob.centroid for blob in blobs]), np.stack([blob.covariance for blob in blobs])
    good = np.all(np.isfinite(centroids), axis=1)
    side = np.sqrt(np.abs(np.linalg.det(board.jacobian(at))))
    good[good] = np.linalg.norm(centroids - board(at), axis=1)[good] < START_LIMIT * side[good]
    seen = Corners(centroids, covariance, good, float("nan"), float("nan"), board)
    if 2 * np.sum(good) <= board.slopes(at).shape[-1]:
        return replace(seen, consistent=np.zeros(len(at), bool))
    for _ in range(ROUNDS):
        seen = replace(seen, points_px=centroids + _centre_offsets(seen.board, at, radius))
        seen = replace(seen, board=next_map(seen, seen.board, at, size))
    contrast = float(np.median([blob.contrast for blob, use in zip(blobs, good, strict=True) if use]))
    return replace(seen, contrast=contrast)


def _is_white_between(image: Grey, board: BoardMap, at: Array, contrast: float) -> bool:
    """Whether it is white at the places between the discs that are farthest from them, where a texture has others."""
    low, high = at.min(axis=0), at.max(axis=0)
    steps = (np.arange(low[k], high[k] + 0.25, 0.5) for k in range(2))
    sites = np.stack(np.meshgrid(*steps), axis=-1).reshape(-1, 2)
    away, nearest = (np.asarray(part) for part in cKDTree(at).query(sites))
    far = away > 0.9 * away.max()
    size = np.array(image.shape[::-1]) - 1.0
    places, discs = (np.rint(np.clip(board(some), 0.0, size)).astype(int) for some in (sites[far], at[nearest[far]]))
    white, black = (image[place[:, 1], place[:, 0]].astype(np.float64) for place in (places, discs))
    return bool(np.mean(white < black + 0.5 * contrast) < MOST_DARK)


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
    contrast = float(np.median((light - grey)[middle])) if np.any(middle) else 0.0
    if total <= 0.0 or np.sqrt(noise) > MOST_UNEVEN * contrast:
        return none
    mean = dark @ offset / total
    spread = (offset - mean) / np.maximum(light, 1.0)[:, None]
    return _Blob(centre + mean, noise * spread.T @ spread / total**2, contrast)
