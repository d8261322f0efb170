"""Whether a board that was found is of another size than the one asked for, by what lies beyond its corners."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.consistency import Corners
from render.targets.chessboard import Chessboard
from render.targets.plain_chessboard import PlainChessboard

BESIDE = 0.25  # squares to either side of a border at which grey values are compared
LEAST_SQUARES = 5  # along a border, in the picture: fewer may look so by chance
MOST = 0.9  # share of them that must look so
SURELY_WHITE = 0.75  # of the way from black to white

# Places within and beyond a border, (n, 2) squares each, and which squares within are white.
Side = tuple[Array, Array, Mask]


def is_of_another_size(
    light: NDArray[np.float32],
    corners: Corners,
    at: Array,
    target: Chessboard | PlainChessboard,
    exchanged: bool = False,
) -> bool:
    """Whether the squares go on beyond the board's border, or end before it where no corner is seen.

    light: the picture, (height, width). at: (n, 2) squares, places of the corners on the board. exchanged: whether the
    board's black squares are white, and its white ones black.
    """
    columns, rows = target.columns, target.rows
    borders = [(axis, place) for axis, count in ((0, columns), (1, rows)) for place in (-1, count - 1)]
    if any(_goes_on(light, corners, _side(target, *border, exchanged)) for border in borders):
        return True
    seen = np.rint(at[corners.consistent]).astype(int)
    if not len(seen):
        return False
    ends = [(axis, place) for axis in (0, 1) for place in (seen[:, axis].min() - 1, seen[:, axis].max() + 1)]
    inside = [end for end in ends if end not in borders]
    return any(_stops(light, corners, _side(target, *end, exchanged)) for end in inside)


def _side(target: Chessboard | PlainChessboard, axis: int, place: int, exchanged: bool) -> Side:
    """The squares along a line of the board, across `axis` at `place`, seen from the board's middle."""
    count = target.rows if axis == 0 else target.columns
    out = 1.0 if place > ((target.columns, target.rows)[axis] - 2) / 2.0 else -1.0
    along = np.arange(count) - 0.5
    within, beyond = (
        np.stack((np.full(count, place + way * out), along)[:: 1 if axis == 0 else -1], axis=1)
        for way in (-BESIDE, BESIDE)
    )
    return within, beyond, (np.floor(within).sum(axis=1) % 2 == 1) != exchanged


def _greys(light: NDArray[np.float32], corners: Corners, side: Side) -> tuple[Array, Array, Mask] | None:
    """Grey values within and beyond, as shares from black to white, and which are white; None if too few are seen."""
    within, beyond, white = side
    places = corners.board(np.concatenate((within, beyond))).astype(np.float32)
    height, width = light.shape
    inside = np.all((places >= 0) & (places <= (width - 1, height - 1)), axis=1)
    grey = cv2.remap(light, places[:, None, 0], places[:, None, 1], cv2.INTER_LINEAR).ravel().astype(float)
    half = len(within)
    both = inside[:half] & inside[half:]
    if np.sum(both) < LEAST_SQUARES or np.all(white[both]) or not np.any(white[both]):
        return None
    low, high = (np.median(grey[:half][both & (white == colour)]) for colour in (False, True))
    if not high > low:
        return None
    shares = (grey - low) / (high - low)
    return shares[:half][both], shares[half:][both], white[both]


def _goes_on(light: NDArray[np.float32], corners: Corners, side: Side) -> bool:
    """Whether each square is followed by one of the other colour."""
    greys = _greys(light, corners, side)
    if greys is None:
        return False
    within, beyond, white = greys
    return bool(np.mean(((within > 0.5) == white) & ((beyond > 0.5) != white)) >= MOST)


def _stops(light: NDArray[np.float32], corners: Corners, side: Side) -> bool:
    """Whether black and white squares are followed by white."""
    greys = _greys(light, corners, side)
    if greys is None:
        return False
    within, beyond, white = greys
    return bool(np.mean(((within > 0.5) == white) & (beyond > SURELY_WHITE)) >= MOST)
