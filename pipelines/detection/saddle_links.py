"""Saddles joined along edges into pieces of a chessboard's lattice.

Two saddles are neighbours if each is the nearest one along an edge of the other, and that edge goes on between them
with its bright side on the same side. So neighbours of a chessboard have black and white exchanged.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from eposit.arrays import Array, Mask
from pipelines.detection.grid_steps import STEPS
from pipelines.detection.saddles import Saddles
from pipelines.detection.sampling import Level, sample

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
    if len(saddles.points) < 4:
        return []
    neighbour, back = _mutual(*_nearest(smoothed, saddles))
    left, pieces = np.ones(len(neighbour), bool), []
    for first in range(len(neighbour)):
        if left[first]:
            piece = _spread(first, neighbour, back, saddles, left)
            if len(piece.points) >= 4 and np.all(np.ptp(piece.cells, axis=0) > 0):
                pieces.append(piece)
    return sorted(pieces, key=lambda piece: -len(piece.points))


def _wrapped(angle: Array) -> Array:
    return (angle + np.pi) % (2.0 * np.pi) - np.pi


def _brightens(saddles: Saddles, which: Indices, edge: Indices) -> Mask:
    """Whether grey values rise with the angle across the edge of that number."""
    return saddles.brightens[which] ^ (edge % 2 == 1)


def _nearest(smoothed: Level, saddles: Saddles) -> tuple[Indices, Indices]:
    """(n, 4) nearest saddle along each edge, -1 for none, and (n, 4) which of its edges leads back."""
    points, n = saddles.points, len(saddles.points)
    count = min(NEAREST + 1, n)
    distance, other = (np.asarray(part)[:, 1:].ravel() for part in cKDTree(points).query(points, k=count))
    own = np.repeat(np.arange(n), count - 1)
    way = points[other] - points[own]
    angle = np.arctan2(way[:, 1], way[:, 0])
    apart, back_apart = (
        np.abs(_wrapped(saddles.angles[which] - towards[:, None]))
        for which, towards in ((own, angle), (other, angle + np.pi))
    )
    edge, back = apart.argmin(axis=1), back_apart.argmin(axis=1)
    fits = (apart.min(axis=1) < ALONG_RAD) & (back_apart.min(axis=1) < ALONG_RAD) & (distance >= LEAST_SIDE_PX)
    fits &= _brightens(saddles, own, edge) != _brightens(saddles, other, back)
    kept = np.flatnonzero(fits)
    kept = kept[_has_edge(smoothed, saddles, own[kept], other[kept], _brightens(saddles, own[kept], edge[kept]))]
    neighbour, leads = np.full((n, 4), -1), np.full((n, 4), -1)
    kept = kept[np.argsort(-distance[kept], kind="stable")]  # the nearest is written last
    neighbour[own[kept], edge[kept]], leads[own[kept], edge[kept]] = other[kept], back[kept]
    return neighbour, leads


def _has_edge(smoothed: Level, saddles: Saddles, own: Indices, other: Indices, brightens: Mask) -> Mask:
    """Whether the edge goes on between two saddles, bright on the side to which the angle rises or on the other."""
    start, way = saddles.points[own], saddles.points[other] - saddles.points[own]
    length = np.linalg.norm(way, axis=1)
    aside = np.stack((-way[:, 1], way[:, 0]), axis=1) * np.minimum(ASIDE, MOST_ASIDE_PX / length)[:, None]
    along = start[:, None] + np.array(PLACES)[:, None] * way[:, None]
    step = sample(smoothed, along + aside[:, None]) - sample(smoothed, along - aside[:, None])
    least = LEAST_EDGE * np.minimum(saddles.swing[own], saddles.swing[other])
    return np.all(np.where(brightens[:, None], step, -step) > least[:, None], axis=1)


def _mutual(neighbour: Indices, back: Indices) -> tuple[Indices, Indices]:
    """Only those neighbours that have each other."""
    own = np.arange(len(neighbour))[:, None]
    both = (neighbour >= 0) & (neighbour[neighbour, back] == own)
    return np.where(both, neighbour, -1), np.where(both, back, -1)


def _spread(first: int, neighbour: Indices, back: Indices, saddles: Saddles, left: Mask) -> Piece:
    """The saddles that can be reached from one, step by step; where two claim a place the first has it."""
    left[first] = False
    cell_of, turn_of = {first: (0, 0)}, {first: 0}  # a saddle's edge k is the lattice's direction k + turn
    taken, queue = {(0, 0)}, deque([first])
    while queue:
        own = queue.popleft()
        (x, y), turn = cell_of[own], turn_of[own]
        for edge in range(4):
            other = int(neighbour[own, edge])
            direction = (edge + turn) % 4
            cell = (x + STEPS[direction][0], y + STEPS[direction][1])
            if other < 0 or not left[other] or cell in taken:
                continue
            left[other] = False
            cell_of[other], turn_of[other] = cell, (direction + 2 - int(back[own, edge])) % 4
            taken.add(cell)
            queue.append(other)
    members = np.array(list(cell_of))
    cells = np.array(list(cell_of.values()), np.int64)
    return Piece(cells, saddles.points[members], bool(saddles.brightens[first]))
