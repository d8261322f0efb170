"""Pieces of a chessboard's lattice grown over the picture: each place is looked for where its neighbours predict it."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.corner_likeness import likeness, most_likely
from pipelines.detection.grid_steps import axes, predicted
from pipelines.detection.lattice_grid import Grid
from pipelines.detection.sampling import Level

LEAST_LIKENESS = 0.72  # half a corner at the edge of what covers the other half has 0.71
LEAST_CONTRAST = 0.3  # of the lattice's median
FARTHEST = 0.36  # squares from the predicted place that a corner may lie
LONGEST_RATIO = 3.0  # between neighbouring sides
WINDOW_SHARE, LEAST_WINDOW_PX, MOST_WINDOW_PX = 0.25, 2, 6  # half side of the window in which a corner is centred
MOST_ROUNDS = 40
STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 20, 0.02)


def verified(level: Level, grid: Grid) -> Grid:
    """The lattice without the points that do not look like its corners, or lie far from where the others say."""
    known = grid.known
    along_x, along_y = axes(grid.points)
    use = known & np.isfinite(along_x[..., 0]) & np.isfinite(along_y[..., 0])
    points = np.full_like(grid.points, np.nan)
    if not np.any(use):
        return grid.with_points(points).cropped()
    like, contrast = likeness(level, grid.points[use], along_x[use], along_y[use], grid.signs[use])
    good = _look_like_corners(like, contrast, median_of_known(contrast))
    good &= _near(grid.points[use], predicted(grid.points)[use], along_x[use], along_y[use])
    points[use] = np.where(good[:, None], grid.points[use], np.nan)
    return grid.with_points(points).cropped()


def grow(level: Level, grid: Grid, most: int) -> Grid:
    """The lattice with all places that can be reached from it step by step, up to `most` columns and rows."""
    contrast = contrast_of(level, grid)
    for _ in range(MOST_ROUNDS):
        if max(grid.points.shape[:2]) > most:
            break
        wide = grid.padded(1)
        found = look_at(level, wide, predicted(wide.points), contrast)
        new = np.where(wide.known[..., None], wide.points, found)
        if np.sum(np.isfinite(new[..., 0])) == np.sum(grid.known):
            break
        grid = wide.with_points(new).cropped()
    return grid


def look_at(level: Level, grid: Grid, expected: Array, contrast: float, farthest: float = FARTHEST) -> Array:
    """(rows, columns, 2) px of corners near where they are expected, NaN where there is none, or one is known.

    contrast: of the lattice. farthest: squares from there that a corner may lie.
    """
    out = np.full_like(grid.points, np.nan)
    along_x, along_y = axes(np.where(np.isfinite(grid.points), grid.points, expected))
    use = ~grid.known & np.all(np.isfinite(np.concatenate((expected, along_x, along_y), axis=-1)), axis=-1)
    if not np.any(use):
        return out
    at, ax, ay, signs = expected[use], along_x[use], along_y[use], grid.signs[use]
    best = most_likely(level, at, ax, ay, signs)
    found = centred(level, best, side_of(ax, ay))
    like, has = likeness(level, found, ax, ay, signs)
    good = _look_like_corners(like, has, contrast) & _near(found, at, ax, ay, farthest)
    out[use] = np.where(good[:, None], found, np.nan)
    return out


def centred(level: Level | NDArray[np.uint8], points: Array, side_px: float) -> Array:
    """(n, 2) px moved to the corners they are near to; as they are where that leads away.

    side_px: of the squares.
    """
    if not len(points):
        return points
    half = int(np.clip(round(WINDOW_SHARE * side_px), LEAST_WINDOW_PX, MOST_WINDOW_PX))
    height, width = level.shape
    inside = np.all((points > half + 1) & (points < np.array([width, height]) - half - 2), axis=1)
    moved = points.copy()
    if np.any(inside) and min(height, width) > 2 * half + 5:
        start = points[inside].astype(np.float32).reshape(-1, 1, 2)
        moved[inside] = cv2.cornerSubPix(level, start, (half, half), (-1, -1), STOP).reshape(-1, 2)
    away = np.linalg.norm(moved - points, axis=1) > half
    return np.where(away[:, None], points, moved)


def side_of(along_x: Array, along_y: Array) -> float:
    """Median of the shorter sides of squares, px; of (n, 2) px along x and along y."""
    return float(np.median(np.minimum(np.linalg.norm(along_x, axis=-1), np.linalg.norm(along_y, axis=-1))))


def contrast_of(level: Level, grid: Grid) -> float:
    """Median half difference between white and black at the lattice's points, grey levels."""
    median = median_of_known(looks(level, grid)[1])
    return median if np.isfinite(median) else 0.0


def median_of_known(values: Array) -> float:
    """Median of those that are not NaN; NaN of none. `np.nanmedian` takes ten times as long."""
    rising = np.sort(values[np.isfinite(values)])
    count = len(rising)
    return float(0.5 * (rising[(count - 1) // 2] + rising[count // 2])) if count else np.nan


def looks(level: Level, grid: Grid) -> tuple[Array, Array]:
    """(rows, columns) likenesses and contrasts of the known points, NaN elsewhere."""
    along_x, along_y = axes(grid.points)
    use = grid.known & np.all(np.isfinite(np.concatenate((along_x, along_y), axis=-1)), axis=-1)
    like, contrast = np.full(use.shape, np.nan), np.full(use.shape, np.nan)
    like[use], contrast[use] = likeness(level, grid.points[use], along_x[use], along_y[use], grid.signs[use])
    return like, contrast


def _look_like_corners(like: Array, contrast: Array, usual: float) -> Mask:
    return (like > LEAST_LIKENESS) & (contrast > LEAST_CONTRAST * usual)


def _near(points: Array, expected: Array, along_x: Array, along_y: Array, farthest: float = FARTHEST) -> Mask:
    """(n,) whether points lie near where they are expected; those of which nothing is expected do."""
    matrix = np.stack((along_x, along_y), axis=-1)
    determinant = np.linalg.det(matrix)
    sound = np.abs(determinant) > 1e-6
    matrix[~sound] = np.eye(2)
    off = np.linalg.solve(matrix, (points - expected)[..., None])[..., 0]
    return sound & ~(np.linalg.norm(off, axis=1) > farthest)
