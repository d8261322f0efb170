"""Saddles joined along edges into pieces of a chessboard's lattice.

Two saddles are neighbours if each is the nearest one along an edge of the other, and that edge goes on between them
with its bright side on the same side. So neighbours of a chessboard have black and white exchanged.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from eposit.arrays import Array, Mask
from pipelines.detection.grid_steps import STEPS
from pipelines.detection.kernels import compiled, compiled_part
from pipelines.detection.saddles import Saddles
from pipelines.detection.sampling import Level, grey_at

Indices = NDArray[np.intp]

NEAREST = 24  # saddles around each among which a neighbour is looked for
LEAST_SIDE_PX = 4.0
ALONG_RAD = 0.5  # between an edge at the saddle and the way to the neighbour
PLACES = (0.3, 0.5, 0.7)  # between two saddles where the edge is looked at
ASIDE, MOST_ASIDE_PX = 0.2, 4.0  # of the distance: how far from the edge its two sides are looked at
LEAST_EDGE = 0.25  # of the saddles' swing


class Piece(NamedTuple):
    """k saddles with their places in a lattice, whose axes turn from x to y as the picture's do."""

    cells: NDArray[np.int64]  # (k, 2) column and row, from any origin
    points: Array  # (k, 2) px of the level
    white_first: bool  # whether the square between (0, 0) and (1, 1) of that lattice is white


def link(smoothed: Level, saddles: Saddles) -> list[Piece]:
    """Pieces of lattices of at least two by two saddles, the largest first."""
    n = len(saddles.points)
    if n < 4:
        return []
    distance, other = (np.asarray(part) for part in cKDTree(saddles.points).query(saddles.points, min(NEAREST + 1, n)))
    neighbour, back = np.full((n, 4), -1), np.full((n, 4), -1)
    _find_neighbours(smoothed, *saddles, distance, other, neighbour, back)
    members, cells, ends = np.empty(n, np.int64), np.empty((n, 2), np.int64), np.empty(n, np.int64)
    count = _spread_all(neighbour, back, members, cells, ends, np.zeros(n, bool), np.empty(n, np.int64))
    bounds = np.append(0, ends[:count])
    parts = [slice(bounds[k], bounds[k + 1]) for k in np.argsort(-np.diff(bounds), kind="stable")]
    pieces = (
        Piece(cells[part], saddles.points[members[part]], bool(saddles.brightens[members[part.start]]))
        for part in parts
        if part.stop - part.start >= 4
    )
    return [piece for piece in pieces if np.all(np.ptp(piece.cells, axis=0) > 0)]


@compiled
def _find_neighbours(
    smoothed: Level,
    points: Array,
    angles: Array,
    brightens: Mask,
    swing: Array,
    distance: Array,
    other: Indices,
    neighbour: Indices,
    back: Indices,
) -> None:
    """Fill in the nearest saddle along each edge, and which of its edges leads back; -1 stays where there is none.

    distance, other: (n, k) of the nearest saddles, from the saddle itself on.
    """
    for own in range(len(points)):
        for k in range(1, other.shape[1]):
            far, away = other[own, k], distance[own, k]
            if away < LEAST_SIDE_PX:
                continue
            angle = math.atan2(points[far, 1] - points[own, 1], points[far, 0] - points[own, 0])
            edge, leads = _edge_along(angles[own], angle), _edge_along(angles[far], angle + math.pi)
            if edge < 0 or leads < 0 or neighbour[own, edge] >= 0:
                continue
            rises = brightens[own] != (edge % 2 == 1)  # whether grey values rise with the angle across the edge
            if rises == (brightens[far] != (leads % 2 == 1)):
                continue
            least = LEAST_EDGE * min(swing[own], swing[far])
            if _least_step(smoothed, points, own, far, away, 1.0 if rises else -1.0) > least:
                neighbour[own, edge], back[own, edge] = far, leads


@compiled_part
def _edge_along(angles: Array, towards: float) -> int:
    """Number of the edge that leaves in a direction; -1 for none."""
    best, least = -1, ALONG_RAD
    for k in range(4):
        apart = abs((angles[k] - towards + math.pi) % (2.0 * math.pi) - math.pi)
        if apart < least:
            best, least = k, apart
    return best


@compiled_part
def _least_step(smoothed: Level, points: Array, own: int, far: int, length: float, sense: float) -> float:
    """The least difference of grey values between the two sides of the edge from one saddle to another."""
    x, y = points[own, 0], points[own, 1]
    way_x, way_y = points[far, 0] - x, points[far, 1] - y
    share = min(ASIDE, MOST_ASIDE_PX / length)
    aside_x, aside_y = -way_y * share, way_x * share
    least = np.inf
    for place in PLACES:
        u, v = x + place * way_x, y + place * way_y
        step = sense * (grey_at(smoothed, u + aside_x, v + aside_y) - grey_at(smoothed, u - aside_x, v - aside_y))
        if not step >= least:  # NaN counts as the least
            least = step
        if math.isnan(least):
            break
    return least


@compiled
def _spread_all(
    neighbour: Indices, back: Indices, members: Indices, cells: Indices, ends: Indices, taken: Mask, turns: Indices
) -> int:
    """Fill in the saddles piece by piece, their places in the piece's lattice, and where each piece ends among them.

    From the first saddle of a piece on, those that can be reached are added step by step; where two claim a place the
    first has it. Only those are neighbours that have each other. Returns the number of pieces.

    taken: (n,) all false. turns: (n,) workspace: a saddle's edge k is the lattice's direction k + turn.
    """
    pieces, end = 0, 0
    for first in range(len(neighbour)):
        if taken[first]:
            continue
        begin, at = end, end
        taken[first] = True
        members[end], cells[end, 0], cells[end, 1], turns[end] = first, 0, 0, 0
        end += 1
        while at < end:
            own = members[at]
            for edge in range(4):
                other, leads = neighbour[own, edge], back[own, edge]
                if other < 0 or taken[other] or neighbour[other, leads] != own:
                    continue
                way = (edge + turns[at]) % 4
                x, y = cells[at, 0] + STEPS[way][0], cells[at, 1] + STEPS[way][1]
                if _is_claimed(cells, begin, end, x, y):
                    continue
                taken[other] = True
                members[end], cells[end, 0], cells[end, 1], turns[end] = other, x, y, (way + 2 - leads) % 4
                end += 1
            at += 1
        ends[pieces] = end
        pieces += 1
    return pieces


@compiled_part
def _is_claimed(cells: Indices, begin: int, end: int, x: int, y: int) -> bool:
    k = begin
    while k < end and (cells[k, 0] != x or cells[k, 1] != y):
        k += 1
    return k < end


def prepare() -> None:
    """Call each compiled function once."""
    points = np.zeros((4, 2))
    link(np.zeros((2, 2), np.float32), Saddles(points, np.zeros((4, 4)), np.zeros(4, bool), np.zeros(4)))
