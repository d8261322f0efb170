"""Which of a board's corners the points of a lattice are: by its size, its colours, its margin and its circle."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.square_look import CLEAR, DISC, SIDES, UNKNOWN, Look
from pipelines.detection.statuses import PointStatus
from render.targets.chessboard import Chessboard
from render.targets.plain_chessboard import PlainChessboard

TURNS = tuple(np.array(turn) for turn in (((1, 0), (0, 1)), ((0, -1), (1, 0)), ((-1, 0), (0, -1)), ((0, 1), (-1, 0))))
AnyChessboard = Chessboard | PlainChessboard
MIRROR = np.array(((-1, 0), (0, 1)))


class Placement(NamedTuple):
    """A lattice laid onto the board: column and row of its point c are `turn @ c + offset` on the board."""

    turn: NDArray[np.int64]  # (2, 2)
    offset: NDArray[np.int64]  # (2,)
    disc: int  # what the square holds where the circle would be: DISC, CLEAR or UNKNOWN
    exchanged: bool = False  # whether the board's black squares are white in the picture, and its white ones black


def identify(
    shape: tuple[int, int], white_first: bool, look: Look, target: AnyChessboard, axes_px: Array
) -> Placement | PointStatus:
    """The one placement that all that is seen allows, or the status that says why there is none.

    shape: columns and rows of the lattice. white_first: whether the square between its first points is white. axes_px:
    (2, 2) directions in the picture, as columns, in which its columns and its rows rise.
    """
    seen = [p for turn in TURNS for p in _placements(turn, shape, white_first, look, target)]
    if isinstance(target, PlainChessboard):
        exchanged = _exchanged(shape, white_first, look, target)
        return _by_squares(seen + exchanged, target, axes_px)
    turns = () if _is_own_mirror_image(target) else TURNS
    flipped = [p for turn in turns for p in _placements(turn @ MIRROR, shape, white_first, look, target)]
    is_shown = any(p.disc == DISC for p in seen + flipped)
    if not is_shown and _is_negative(shape, white_first, look, target):
        return PointStatus.OTHER_BOARD
    return _by_circle(seen, flipped)


def _is_negative(shape: tuple[int, int], white_first: bool, look: Look, target: Chessboard) -> bool:
    """Whether black and white are exchanged, by a black margin or by a white disc where the circle would be then."""
    turns = [*TURNS, *(turn @ MIRROR for turn in TURNS)]
    other = [p for turn in turns for p in _placements(turn, shape, not white_first, look, target)]
    return any(p.disc == DISC for p in other) or (any(look.dark_ends) and not any(look.ends))


def _by_circle(seen: list[Placement], flipped: list[Placement]) -> Placement | PointStatus:
    """Among the placements of the board, and those of its mirror image.

    A placement that puts the circle on a square without one is out. Where that leaves none, nor one of the mirror
    image, the board has no circle. Where the circle is not seen, a mirrored board may look the same: it is out only if
    the square where it would have its circle is seen to have none.
    """
    shown, shown_flipped = ([p for p in some if p.disc == DISC] for some in (seen, flipped))
    if shown_flipped and not shown:
        is_open = any(p.disc == UNKNOWN for p in seen)
        return PointStatus.ORIENTATION_AMBIGUOUS if is_open else PointStatus.MIRRORED
    if not seen:
        return PointStatus.OTHER_BOARD
    left = shown or [p for p in seen if p.disc != CLEAR]
    is_upright = bool(shown) or all(p.disc == CLEAR for p in flipped)
    if not left and is_upright:
        left = seen
    is_told = len(left) == 1 and is_upright and not shown_flipped
    return left[0] if is_told else PointStatus.ORIENTATION_AMBIGUOUS


def _is_own_mirror_image(target: Chessboard) -> bool:
    """Whether a mirror puts the board's squares on its squares and the circle on the circle."""
    middle = np.array(target.circle_square) - (np.array((target.columns, target.rows)) + 1) / 2.0
    kept = (turn @ MIRROR for turn in TURNS if turn[0, 0] != 0 or target.columns == target.rows)
    return any(np.array_equal(mirror @ middle, middle) for mirror in kept)


def _exchanged(shape: tuple[int, int], white_first: bool, look: Look, target: PlainChessboard) -> list[Placement]:
    """Placements with white on black, where a print with exchanged colours is another board than the target.

    It is the target after half a turn where that changes the colours, and after a quarter where the board is square.
    """
    if target.tells_orientation or (target.columns == target.rows and target.columns % 2 == 0):
        return []
    found = [p for turn in TURNS for p in _placements(turn, shape, not white_first, look, target)]
    return [p._replace(exchanged=True) for p in found]


def _by_squares(seen: list[Placement], target: PlainChessboard, axes_px: Array) -> Placement | PointStatus:
    """Where half a turn makes no difference the board is read as standing upright: x to the right in the picture."""
    if len(seen) == 2 and _is_half_turn(seen[0], seen[1], target.inner):
        return max(seen, key=lambda p: float((axes_px @ p.turn.T[:, 0])[0]))
    if len(seen) == 1:
        return seen[0]
    return PointStatus.ORIENTATION_AMBIGUOUS if seen else PointStatus.OTHER_BOARD


def _is_half_turn(one: Placement, other: Placement, inner: tuple[int, int]) -> bool:
    opposite = np.array_equal(one.turn, -other.turn)
    return opposite and np.array_equal(one.offset + other.offset, np.array(inner) - 1)


def _placements(
    turn: NDArray[np.int64],
    shape: tuple[int, int],
    white_first: bool,
    look: Look,
    target: AnyChessboard,
) -> list[Placement]:
    """All with that turn that lie on the board, with black on black, and its borders where the margin is seen."""
    ((a, b), (c, d)), (across, down) = turn.tolist(), (shape[0] - 1, shape[1] - 1)
    low = min(0, a * across) + min(0, b * down), min(0, c * across) + min(0, d * down)
    size = (down, across) if b else (across, down)
    room = target.inner[0] - 1 - size[0], target.inner[1] - 1 - size[1]
    places = [range(room[0] + 1), range(room[1] + 1)]  # of the lattice's least column and row on the board
    for (x, y), is_end in zip(SIDES, look.ends, strict=True):
        if is_end:
            way = a * x + b * y, c * x + d * y
            axis = 0 if way[0] else 1
            place = 0 if way[axis] < 0 else room[axis]
            places[axis] = places[axis][place : place + 1] if place in places[axis] else range(0)
    found = []
    for x in places[0]:
        for y in places[1]:
            offset = x - low[0], y - low[1]
            first = offset[0] + (a + b - 1) // 2 + offset[1] + (c + d - 1) // 2  # column and row of the first square
            if (first % 2 == 1) == white_first:
                found.append(Placement(turn, np.array(offset), _disc_at(turn, offset, look, target)))
    return found


def _disc_at(turn: NDArray[np.int64], offset: tuple[int, int], look: Look, target: AnyChessboard) -> int:
    """What is seen where a placement puts the circle; UNKNOWN outside what was looked at, and for a board without."""
    if isinstance(target, PlainChessboard):
        return UNKNOWN
    middle = (square - 1.5 for square in target.circle_square)  # the first inner corner is the board's (0, 0)
    x, y = (along - shift for along, shift in zip(middle, offset, strict=True))
    column, row = (math.floor(x * along + y * aside) + 1 for along, aside in turn.T.tolist())
    rows, columns = look.discs.shape
    return int(look.discs[row, column]) if 0 <= row < rows and 0 <= column < columns else UNKNOWN
