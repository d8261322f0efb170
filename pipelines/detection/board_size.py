"""Whether a board that was found is of another size than the one asked for, by what lies beyond its corners."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap
from pipelines.detection.border_lines import Line, corner_places, goes_on, share_of_corners
from pipelines.detection.consistency import Corners
from pipelines.detection.sampling import sample
from render.targets.chessboard import Chessboard
from render.targets.plain_chessboard import PlainChessboard

BESIDE = 0.25  # squares to either side of a line at which grey values are compared
LEAST_SQUARES = 5  # along a line, in the picture: fewer may look so by chance
MOST = 0.85  # share of them that must look so
SEEN_WELL = 0.5  # share of a line's corners
SHADED_WHITE = 0.15  # of the way from black to the brightest white: shadows leave more of white, and black has less
# Share of a line's places that look like corners and of the squares beyond it that are dark, together: shadows make as
# many where the board has ended.
MOST_ALIKE = 0.4


def is_of_another_size(
    light: NDArray[np.float32],
    corners: Corners,
    at: Array,
    target: Chessboard | PlainChessboard,
    exchanged: bool = False,
) -> bool:
    """Whether the squares go on beyond the board's border, end before it, or go on across a line of its corners.

    light: the picture, (height, width). at: (n, 2) squares, places of the corners on the board. exchanged: whether the
    board's black squares are white, and its white ones black.
    """
    sizes = target.columns, target.rows
    borders = [(axis, place) for axis in (0, 1) for place in (-1, sizes[axis] - 1)]
    if any(goes_on(light, corners.board, _line(sizes, *border), exchanged) for border in borders):
        return True
    seen = np.zeros(target.inner, bool)
    column, row = np.rint(at[corners.consistent]).astype(int).T
    seen[column, row] = True
    return any(
        _contradicts(light, corners.board, _line(sizes, axis, place), exchanged, is_end=is_end)
        for axis in (0, 1)
        for place, is_end in _lines_in_part(seen.mean(axis=1 - axis))
    )


def _lines_in_part(shares: Array) -> list[tuple[int, bool]]:
    """Lines (n,) of which not all corners are seen, and whether all that are seen well lie to one side of them."""
    well = np.flatnonzero(shares >= SEEN_WELL)
    return [(int(k), bool(np.all(well >= k) or np.all(well <= k))) for k in np.flatnonzero(shares < 1.0)]


def _line(sizes: tuple[int, int], axis: int, place: int) -> Line:
    """A line of a board of so many columns and rows of squares."""
    return Line(axis, place, 1 if place > (sizes[axis] - 2) / 2.0 else -1, 0, sizes[1 - axis] - 2)


def _contradicts(light: NDArray[np.float32], board: BoardMap, line: Line, exchanged: bool, *, is_end: bool) -> bool:
    """Whether a line is seen that is none of the board's: squares go on across it, or end at it.

    is_end: whether they may end there.
    """
    share = share_of_corners(corner_places(light, board, line, exchanged))
    if share is None or share > MOST_ALIKE:
        return False
    along = np.arange(line.first, line.last + 2) - 0.5
    within, beyond = (_places(line, along, way) for way in (-BESIDE, BESIDE))
    white = (np.floor(within).sum(axis=1) % 2 == 0) == exchanged
    greys = sample(light, board(np.concatenate((within, beyond)))).reshape(2, -1)
    seen = np.isfinite(greys).all(axis=0)
    if np.sum(seen) < LEAST_SQUARES or np.all(white[seen]) or not np.any(white[seen]):
        return False
    low, high = np.median(greys[0][seen & ~white]), np.max(greys[0][seen & white])  # most of it may be in shadows
    if not high > low:
        return False
    is_white, white = (greys[:, seen] - low) / (high - low) > SHADED_WHITE, white[seen]
    inside, across = np.mean(is_white == white, axis=1)
    ends = is_end and share + np.mean(~is_white[1]) <= MOST_ALIKE
    return bool(inside >= MOST and (ends or across >= MOST))


def _places(line: Line, along: Array, way: float) -> Array:
    """(n, 2) squares, so far beyond a line."""
    across = np.full(len(along), line.place + way * line.out)
    return np.stack((across, along) if line.axis == 0 else (along, across), axis=1)
