"""Whether a chessboard goes on beyond a line of its lattice, or ends there, whatever light falls on it.

Around a corner two opposite squares are far brighter than the other two, also where one of them is in a shadow. Around
a place on the board's border they are not, as the margin has one colour.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from eposit.arrays import Array, Mask
from pipelines.detection.board_map import BoardMap
from pipelines.detection.sampling import Level, sample

NEAR, FAR = 0.2, 0.3  # squares from the two lines through a corner, at which the squares around it are looked at
BRIGHTER = 2.0  # times as far above black as the dark squares: shadows halve the light, print takes nine tenths of it
LEAST_PLACES = 4  # of a line, in view: fewer may look so by chance
MOST = 0.6  # share of them that look like corners: some may be covered; shadows make up to a third of a border's so


class Line(NamedTuple):
    """A line of a lattice, across its columns (axis 0) or its rows (axis 1)."""

    axis: int
    place: int  # column or row
    out: int  # 1 or -1: the direction, along the axis, that leads away from the lattice's middle
    first: int  # row or column on it
    last: int


def goes_on(level: Level, board: BoardMap, line: Line, white_first: bool) -> bool:
    """Whether squares of both colours are seen to follow beyond the line; see `corner_places`."""
    share = share_of_corners(corner_places(level, board, line, white_first))
    return share is not None and share >= MOST


def share_of_corners(places: Array) -> float | None:
    """Of a line's places (n,), see `corner_places`, those that look like corners; None if too few are in view."""
    seen = np.isfinite(places)
    return float(np.mean(places[seen])) if np.sum(seen) >= LEAST_PLACES else None


def corner_places(level: Level, board: BoardMap, line: Line, white_first: bool) -> Array:
    """(n,) 1 where squares look as around a corner of a line, 0 where they do not, NaN out of view.

    board: map from column and row of the lattice to the picture. white_first: whether the square before the lattice's
    first column and row is white.
    """
    within, beyond, white = _around(line, white_first)
    greys = [sample(level, board(part.reshape(-1, 2)).reshape(part.shape)).mean(axis=-1) for part in (within, beyond)]
    seen = np.isfinite(greys[0]) & np.isfinite(greys[1])
    if not np.any(seen & ~white):
        return np.full(len(white), np.nan)
    within, beyond = (grey - np.median(greys[0][seen & ~white]) for grey in greys)
    bright = np.where(white, within, beyond).min(axis=1)
    dark = np.where(white, beyond, within).max(axis=1)
    return np.where(seen.all(axis=1), bright > BRIGHTER * np.maximum(dark, 0.0), np.nan)


def _around(line: Line, white_first: bool) -> tuple[Array, Array, Mask]:
    """Places (corners, 2, 3, 2) squares within and beyond the line, to either side of each corner; which is white.

    The last is of the squares within, (corners, 2).
    """
    corners = np.arange(line.first, line.last + 1)[:, None, None]
    sides = np.array((-1.0, 1.0))[:, None]
    along = corners + sides * (NEAR, FAR, NEAR)
    parts = []
    for way in (-line.out, line.out):
        across = np.broadcast_to(line.place + way * np.array((NEAR, NEAR, FAR)), along.shape)
        parts.append(np.stack((across, along) if line.axis == 0 else (along, across), axis=-1))
    square = np.floor(parts[0][:, :, 0]).sum(axis=-1)  # from -2: that before the first column and row
    return parts[0], parts[1], (square % 2 == 0) == white_first
