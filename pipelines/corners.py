"""From a found board to sub-pixel corners that agree with each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eposit.arrays import Array, Mask
from pipelines.board import Grey
from pipelines.saddle import fit_saddles
from pipelines.surface import BoardMap, grid, leave_one_out
from render.target import Target

WINDOW_PX = 7  # half side of the pixels that a fit may use
WINDOW_SHARE = 0.55  # of the way to the neighbouring corners: beyond that the next edges come near
CIRCLE_MARGIN_PX = 2.5  # kept clear around the circle and its shade: three times the blur
LEAST_PIXELS = 20
START_LIMIT_SHARE = 0.3  # of the local square: a fit that moves further has gone to another corner
LIMIT_PX = 0.5  # largest distance of a corner from the map through the others
LIMIT_SHARE = 0.03  # or this share of the local square, whichever is more
BAD_SHARE = 0.1  # of the corners that may be inconsistent before the board is


@dataclass(frozen=True, slots=True)
class Corners:
    """Refined corners in the order of `Target.corners`."""

    points_px: Array  # (n, 2)
    consistent: Mask  # (n,) agrees with the map through the others
    blur_px: float  # median blur of the edges


def refine_corners(image: Grey, board: BoardMap, circle_px: Array, target: Target) -> Corners:
    """Fit every corner near where `board` puts it, clear of the circle at `circle_px`, and check it by the others."""
    at = grid(target.inner)
    start, jacobian = board(at), board.jacobian(at)
    offsets = np.stack(np.meshgrid(*(np.arange(-WINDOW_PX, WINDOW_PX + 1),) * 2), axis=-1).reshape(-1, 2)
    positions = np.rint(start).astype(int)[:, None] + offsets
    inside = np.all((positions >= 0) & (positions < image.shape[::-1]), axis=-1)
    x, y = np.clip(positions[..., 0], 0, image.shape[1] - 1), np.clip(positions[..., 1], 0, image.shape[0] - 1)
    relative = positions - start[:, None]
    squares = np.einsum("nij,npj->npi", np.linalg.inv(jacobian), relative)
    use = inside & (np.abs(squares).max(axis=-1) < WINDOW_SHARE) & (np.linalg.norm(relative, axis=-1) <= WINDOW_PX)
    use &= ~_near_circle(positions.astype(np.float64), board, circle_px, target)
    # The normal of the edge along y is perpendicular to the image of the y direction, and so for x.
    angles = np.arctan2(-jacobian[:, 0, ::-1], jacobian[:, 1, ::-1])
    fitted = fit_saddles(
        image[y, x].astype(np.float64), positions.astype(np.float64), use.astype(np.float64), angles, start
    )
    side = np.sqrt(np.abs(np.linalg.det(jacobian)))
    usable = (use.sum(axis=1) >= LEAST_PIXELS) & (fitted.moved_px <= START_LIMIT_SHARE * side)
    return Corners(
        fitted.points_px, _consistent(fitted.points_px, usable, side, target.inner), float(np.median(fitted.blur_px))
    )


def _near_circle(positions: Array, board: BoardMap, circle_px: Array, target: Target) -> Mask:
    """(n, p) pixels on the circle or on its shade at its foot."""
    foot = target.circle_centre[:2] / target.square_mm
    inverse = np.linalg.inv(board.jacobian(foot))
    radius = target.circle_radius_mm / target.square_mm + CIRCLE_MARGIN_PX * np.linalg.norm(inverse, axis=1).max()
    return np.any(
        [np.linalg.norm((positions - place) @ inverse.T, axis=-1) < radius for place in (board(foot)[0], circle_px)],
        axis=0,
    )


def _consistent(points: Array, usable: Mask, side: Array, inner: tuple[int, int]) -> Mask:
    """Drop the corner farthest from the map through the others until all the rest agree."""
    good = usable.copy()
    limit = np.maximum(LIMIT_PX, LIMIT_SHARE * side)
    for _ in range(int(BAD_SHARE * len(points)) + 1):
        excess = np.where(good, leave_one_out(points, inner, good) / limit, 0.0)
        worst = int(np.argmax(excess))
        if excess[worst] <= 1.0:
            break
        good[worst] = False
    return good
