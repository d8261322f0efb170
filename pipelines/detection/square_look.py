"""What the squares of a lattice look like: which hold a dark disc, and on which sides the board ends in its margin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap
from pipelines.detection.lattice_grid import Grid
from pipelines.detection.sampling import Level, sample

INNER = np.linspace(-0.42, 0.42, 15)  # squares from a square's middle at which it is looked at, along x and y
LIGHT_REACH = 1.5  # squares: how far the grey of other squares of its colour counts for a square's own
CLEAR_SHARE = 0.2  # of the disc's area: a square with less darkness holds no disc
UNEVEN = 0.2  # darkness that light and noise make on white
DISC_SHARES = (0.4, 2.2)  # of the disc's area, with its shadow
DISC_OFF = 0.38  # squares that the middle of the disc may lie from that of the square: it stands above the board
DISC_SPREAD = 1.7  # of a disc's mean square distance from its middle, which other dark shapes exceed
BEYOND, MOST_BEYOND = 0.5, 0.25  # of the margin, and squares: how far beyond the last squares is looked for white
BESIDE = np.array([-0.25, 0.0, 0.25])  # squares along the side
LEAST_MARGIN = 0.2  # squares: a narrower one is not looked for
LEAST_SQUARES, LEAST_PASSING = 3, 0.75  # of a side that must be in view, and their share that must look like an end
SIDES = ((-1, 0), (1, 0), (0, -1), (0, 1))  # of a lattice: left, right, top, bottom

CLEAR, DISC, UNKNOWN = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Look:
    """Of a lattice of (rows, columns) points. The square at row 0, column 0 lies before the first point."""

    discs: NDArray[np.int64]  # (rows + 1, columns + 1) CLEAR, DISC or UNKNOWN, which every black square is
    ends: tuple[bool, bool, bool, bool]  # whether the margin is seen on each of the SIDES


def look_at_squares(level: Level, board: BoardMap, grid: Grid, radius: float | None, margin: float) -> Look:
    """Look at all squares between and around the lattice's points.

    board: map from column and row of the lattice to the level. radius, margin: of the target's disc, if it has one, and
    its white margin, in squares.
    """
    rows, columns = grid.points.shape[:2]
    x, y = np.meshgrid(np.arange(columns + 1) - 0.5, np.arange(rows + 1) - 0.5)
    middles = np.stack((x, y), axis=-1)
    v, u = np.meshgrid(INNER, INNER, indexing="ij")
    places = middles[:, :, None] + np.stack((u.ravel(), v.ravel()), axis=-1)
    grey = sample(level, board(places.reshape(-1, 2)).reshape(*places.shape[:2], -1, 2).reshape(-1, places.shape[2], 2))
    grey = grey.reshape(rows + 1, columns + 1, -1)
    white = (np.add.outer(np.arange(rows + 1), np.arange(columns + 1)) % 2 == 0) == grid.white_first
    levels = _levels(grey, white)
    discs = np.full(white.shape, UNKNOWN)
    if radius is not None:
        dark = (levels[1][..., None] - grey) / np.maximum(levels[1] - levels[0], 1e-6)[..., None]
        discs[white] = _classified(dark[white], radius)
    middle = levels.mean(axis=0)
    ends = [_ends(level, board, side, white, middle, margin) for side in SIDES]
    return Look(discs, (ends[0], ends[1], ends[2], ends[3]))


def _levels(grey: Array, white: Mask) -> Array:
    """(2, rows, columns) grey of black and of white at each square, from the squares between points around it."""
    rows, columns = white.shape
    y, x = np.mgrid[0:rows, 0:columns]
    inner = (y > 0) & (y < rows - 1) & (x > 0) & (x < columns - 1)
    median = np.median(grey, axis=-1)
    levels = np.full((2, rows, columns), np.nan)
    for colour in (False, True):
        some = inner & (white == colour) & np.isfinite(median)
        square = (y[..., None] - y[some]) ** 2 + (x[..., None] - x[some]) ** 2
        weight = np.exp(-0.5 * square / LIGHT_REACH**2) + 1e-12
        if np.any(some):
            levels[int(colour)] = (weight @ median[some]) / weight.sum(axis=-1)
    return levels


def _classified(dark: Array, radius: float) -> NDArray[np.int64]:
    """(n,) what white squares hold, from how dark their places (n, m) are: 0 white, 1 black, NaN out of view.

    Of blurred discs the darkness is summed, which is as much as that of sharp ones.
    """
    v, u = (part.ravel() for part in np.meshgrid(INNER, INNER, indexing="ij"))
    area = float(np.mean(np.hypot(u, v) < radius))
    whole, dark = np.isfinite(dark).all(axis=1), np.clip(dark - UNEVEN, 0.0, 1.0) / (1.0 - UNEVEN)
    share, total = dark.mean(axis=1) / area, np.maximum(dark.sum(axis=1), 1e-6)
    mean_u, mean_v = dark @ u / total, dark @ v / total
    spread = dark @ (u**2 + v**2) / total - mean_u**2 - mean_v**2
    disc = (share > DISC_SHARES[0]) & (share < DISC_SHARES[1]) & (np.hypot(mean_u, mean_v) < DISC_OFF)
    disc &= spread < DISC_SPREAD * 0.5 * radius**2
    return np.where(whole & disc, DISC, np.where(whole & (share < CLEAR_SHARE), CLEAR, UNKNOWN))


def _ends(level: Level, board: BoardMap, side: tuple[int, int], white: Mask, middle: Array, margin: float) -> bool:
    """Whether the squares on one side are the board's last: what lies beyond them is white, beyond white ones, too."""
    if margin < LEAST_MARGIN:
        return False
    rows, columns = white.shape
    beyond = min(BEYOND * margin, MOST_BEYOND)
    if side[0]:
        line, count = (slice(None), 0 if side[0] < 0 else columns - 1), rows
    else:
        line, count = (0 if side[1] < 0 else rows - 1, slice(None)), columns
    border = -1.0 if sum(side) < 0 else (columns if side[0] else rows) - 1.0
    along = (np.arange(count) - 0.5)[:, None] + BESIDE
    grey = []
    for way in (-beyond, beyond):  # within the squares, then beyond them
        across = np.full(along.shape, border + way * sum(side))
        places = np.stack((across, along) if side[0] else (along, across), axis=-1)
        grey.append(sample(level, board(places.reshape(-1, 2)).reshape(places.shape)).mean(axis=1))
    seen = np.isfinite(grey[0]) & np.isfinite(grey[1])
    passing = ((grey[0] > middle[line]) == white[line]) & (grey[1] > middle[line])
    enough = np.sum(seen & white[line]) >= 1 and np.sum(seen & ~white[line]) >= 1 and np.sum(seen) >= LEAST_SQUARES
    return bool(enough and np.mean(passing[seen]) >= LEAST_PASSING)
