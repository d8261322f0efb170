"""What the squares of a lattice look like: which hold a dark disc, and on which sides the board ends in its margin."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap
from pipelines.detection.lattice_grid import Grid
from pipelines.detection.sampling import Level, sample

INNER = np.linspace(-0.42, 0.42, 15)  # squares from a square's middle at which it is looked at, along x and y
PLACES = np.stack([part.ravel() for part in np.meshgrid(INNER, INNER)], axis=-1)
LIGHT_REACH = 1.5  # squares: how far the grey of other squares of its colour counts for a square's own
CLEAR_SHARE = 0.2  # of the disc's area: a square with less darkness holds no disc
UNEVEN = 0.2  # darkness that light and noise make on white
SHADOW = 0.75  # darkness that shadows make on white: what is darker is print
MOSTLY_CLEAR = 0.85  # of the squares: in deeper shadows, which show more of it, print is not told from them
DISC_SHARES = (0.4, 2.2)  # of the disc's area, with its shadow
DISC_OFF = 0.38  # squares that the middle of the disc may lie from that of the square: it stands above the board
DISC_SPREAD = 1.7  # of a disc's mean square distance from its middle, which other dark shapes exceed
DISC_PLACES = np.linspace(-0.6, 0.6, 13)  # squares from a square's middle at which discs are compared with it
DISC_SIZES = (0.85, 1.0, 1.2)  # of its radius: thin print, and a shadow beside it
EDGE_TURNS, EDGE_PLACES = 16, np.linspace(-0.36, 0.36, 13)  # of shadows' edges that are compared with it, squares
STRIPS = (0.1, 0.2, 0.3)  # squares: of narrow shadows, half the width
BEYOND, MOST_BEYOND = 0.5, 0.25  # of the margin, and squares: how far beyond the last squares is looked for white
BESIDE = np.array([-0.25, 0.0, 0.25])  # squares along the side
LEAST_MARGIN = 0.2  # squares: a narrower one is not looked for
LEAST_SQUARES, LEAST_PASSING = 3, 0.75  # of a side that must be in view, and their share that must look like an end
SIDES = ((-1, 0), (1, 0), (0, -1), (0, 1))  # of a lattice: left, right, top, bottom

CLEAR, DISC, UNKNOWN = 0, 1, 2


@dataclass(frozen=True, slots=True)
class Look:
    """Of a lattice of (rows, columns) points. The square at row 0, column 0 lies before the first point."""

    discs: NDArray[np.int64]  # (rows + 1, columns + 1) CLEAR, DISC or UNKNOWN; of a black square, as to a white disc
    ends: tuple[bool, ...]  # whether the margin is seen on each of the SIDES
    dark_ends: tuple[bool, ...]  # whether a black one is


def look_at_squares(level: Level, board: BoardMap, grid: Grid, radius: float | None, margin: float) -> Look:
    """Look at all squares between and around the lattice's points.

    board: map from column and row of the lattice to the level. radius, margin: of the target's disc, if it has one, and
    its white margin, in squares.
    """
    rows, columns = grid.points.shape[:2]
    x, y = np.meshgrid(np.arange(columns + 1) - 0.5, np.arange(rows + 1) - 0.5)
    places = np.stack((x, y), axis=-1)[:, :, None] + PLACES
    grey = sample(level, board(places.reshape(-1, 2))).reshape(rows + 1, columns + 1, -1)
    white = (np.add.outer(np.arange(rows + 1), np.arange(columns + 1)) % 2 == 0) == grid.white_first
    levels = _levels(grey, white)
    discs = np.full(white.shape, UNKNOWN)
    if radius is not None:
        dark = (levels[1][..., None] - grey) / np.maximum(levels[1] - levels[0], 1e-6)[..., None]
        dark = np.where(white[..., None], dark, 1.0 - dark).reshape(white.size, -1)
        discs = _found_in_shadows(_classified(dark, radius, UNEVEN), dark, radius).reshape(white.shape)
    return Look(discs, *_ends(level, board, white, levels.mean(axis=0), margin))


def _levels(grey: Array, white: Mask) -> Array:
    """(2, rows, columns) grey of black and of white at each square, from the squares between points around it."""
    rows, columns = white.shape
    y, x = np.mgrid[0:rows, 0:columns]
    inner = (y > 0) & (y < rows - 1) & (x > 0) & (x < columns - 1)
    half = grey.shape[-1] // 2
    median = np.where(np.isfinite(grey).all(axis=-1), np.partition(grey, half, axis=-1)[..., half], np.nan)
    levels = np.full((2, rows, columns), np.nan)
    for colour in (False, True):
        some = inner & (white == colour) & np.isfinite(median)
        square = (y[..., None] - y[some]) ** 2 + (x[..., None] - x[some]) ** 2
        weight = np.exp(-0.5 * square / LIGHT_REACH**2) + 1e-12
        if np.any(some):
            levels[int(colour)] = (weight @ median[some]) / weight.sum(axis=-1)
    return levels


def _found_in_shadows(discs: NDArray[np.int64], dark: Array, radius: float) -> NDArray[np.int64]:
    """(n,) what squares hold, with a disc that shadows across its square hide, which are less dark than print.

    discs: (n,) what they hold otherwise. dark: see `_classified`.
    """
    deep = _classified(dark, radius, SHADOW)
    is_told = np.sum(deep == DISC) == 1 and np.mean(deep[np.isfinite(dark).all(axis=1)] == CLEAR) >= MOSTLY_CLEAR
    return np.where((discs == UNKNOWN) & (deep == DISC), DISC, discs) if is_told else discs


def _classified(dark: Array, radius: float, least: float) -> NDArray[np.int64]:
    """(n,) what squares hold, from how dark their places (n, m) are: 0 white, 1 black, NaN out of view.

    Of black squares, from how bright they are. Of blurred discs the darkness is summed, which is as much as that of
    sharp ones.
    """
    u, v = PLACES.T
    area = float(np.mean(np.hypot(u, v) < radius))
    whole, dark = np.isfinite(dark).all(axis=1), np.clip(dark - least, 0.0, 1.0) / (1.0 - least)
    share, total = dark.mean(axis=1) / area, np.maximum(dark.sum(axis=1), 1e-6)
    mean_u, mean_v = dark @ u / total, dark @ v / total
    spread = dark @ (u**2 + v**2) / total - mean_u**2 - mean_v**2
    disc = (share > DISC_SHARES[0]) & (share < DISC_SHARES[1]) & (np.hypot(mean_u, mean_v) < DISC_OFF)
    disc &= spread < DISC_SPREAD * 0.5 * radius**2
    disc[disc] = _is_nearer_to_disc(dark[disc], radius)
    return np.where(whole & disc, DISC, np.where(whole & (share < CLEAR_SHARE), CLEAR, UNKNOWN))


def _is_nearer_to_disc(dark: Array, radius: float) -> Mask:
    """(n,) whether the places (n, m) of squares are dark as under a disc, rather than as beside a shadow's edge."""
    even = dark - dark.mean(axis=1)[:, None]
    discs, edges = (even @ part.T for part in _looks_of(radius))
    return discs.max(axis=1) > np.abs(edges).max(axis=1)  # of a shadow either side of its edge may be the dark one


@lru_cache(maxsize=8)
def _looks_of(radius: float) -> tuple[Array, Array]:
    """(k, m) looks of discs, and of the edges of shadows and narrow shadows; each of mean zero and length one."""
    u, v = PLACES.T
    y, x = (part.reshape(-1, 1) for part in np.meshgrid(DISC_PLACES, DISC_PLACES))
    discs = np.concatenate([np.hypot(u - x, v - y) < size * radius for size in DISC_SIZES])
    turn = np.arange(EDGE_TURNS)[:, None, None] * np.pi / EDGE_TURNS
    away = (np.cos(turn) * u + np.sin(turn) * v - EDGE_PLACES[:, None]).reshape(-1, len(PLACES))
    edges = np.concatenate([away > 0.0, *(np.abs(away) < half for half in STRIPS)])
    return _even(discs), _even(edges)


def _even(looks: Mask) -> Array:
    """Of mean zero and length one, without those that are the same everywhere."""
    parts = looks[looks.any(axis=1) & ~looks.all(axis=1)].astype(np.float64)
    parts -= parts.mean(axis=1)[:, None]
    return parts / np.linalg.norm(parts, axis=1)[:, None]


def _ends(
    level: Level, board: BoardMap, white: Mask, middle: Array, margin: float
) -> tuple[tuple[bool, ...], tuple[bool, ...]]:
    """On which of the SIDES the squares are the board's last, and on which those of a board in negative.

    What lies beyond them is white there, beyond white ones, too; in negative it is black, beyond black ones, too.
    """
    if margin < LEAST_MARGIN:
        return (False,) * len(SIDES), (False,) * len(SIDES)
    beyond = min(BEYOND * margin, MOST_BEYOND)
    places = [_beside(side, white.shape, way) for side in SIDES for way in (-beyond, beyond)]  # within, then beyond
    grey = sample(level, board(np.concatenate(places).reshape(-1, 2))).reshape(-1, len(BESIDE)).mean(axis=1)
    parts = np.split(grey, np.cumsum([len(part) for part in places])[:-1])
    lines = ((slice(None), 0), (slice(None), -1), (0, slice(None)), (-1, slice(None)))  # of the squares on each side
    sides = [(parts[2 * k], parts[2 * k + 1], white[line], middle[line]) for k, line in enumerate(lines)]
    negative = [(-within, -beyond, ~is_white, -half) for within, beyond, is_white, half in sides]
    return tuple(_is_end(*side) for side in sides), tuple(_is_end(*side) for side in negative)


def _beside(side: tuple[int, int], squares: tuple[int, int], way: float) -> Array:
    """(n, 3, 2) places along a side, `way` squares further out than the last squares reach."""
    rows, columns = squares
    along = (np.arange(rows if side[0] else columns) - 0.5)[:, None] + BESIDE
    border = -1.0 if sum(side) < 0 else (columns if side[0] else rows) - 1.0
    across = np.full(along.shape, border + way * sum(side))
    return np.stack((across, along) if side[0] else (along, across), axis=-1)


def _is_end(within: Array, beyond: Array, white: Mask, middle: Array) -> bool:
    """Whether squares (n,) are the board's last, by the grey values in them and beyond them."""
    seen = np.isfinite(within) & np.isfinite(beyond)
    passing = ((within > middle) == white) & (beyond > middle)
    enough = np.sum(seen & white) >= 1 and np.sum(seen & ~white) >= 1 and np.sum(seen) >= LEAST_SQUARES
    return bool(enough and np.mean(passing[seen]) >= LEAST_PASSING)
