"""A fixed design of triangles over an object's points: a wrong point is in few of them."""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array

THIN = 0.05  # share of the largest area below which a triangle tells a pose badly
STRIDE_POINTS = 24  # of more points only so many, evenly taken, are corners: 2024 triangles


def spread_triangles(points_in_obj: Array, count: int) -> list[list[int]]:
    """Up to `count` triangles of (n, 3) points, as indices; none if all points lie on a line.

    They come in rounds. Within a round no two share a point, so that two wrong points spoil two at most; each is the
    widest that is left.
    """
    n = len(points_in_obj)
    corners = np.unique(np.linspace(0, n - 1, min(n, STRIDE_POINTS)).round().astype(np.int64))
    triples = corners[np.array(list(itertools.combinations(range(len(corners)), 3)))]
    areas = _areas(points_in_obj, triples)
    wide = np.argsort(-areas, kind="stable")[: int(np.sum(areas > THIN * np.max(areas)))]
    left, found = triples[wide], list[list[int]]()
    while len(left) and len(found) < count:
        taken = _disjoint(left, n)
        found += [[int(i) for i in three] for three in left[taken]]
        left = np.delete(left, taken, axis=0)
    return found[:count]


def _disjoint(triples: NDArray[np.int64], n: int) -> list[int]:
    """Rows that share no point, earlier rows first."""
    free, taken, rows = np.ones(n, bool), list[int](), np.arange(len(triples))
    while len(rows):
        row = int(rows[0])
        taken.append(row)
        free[triples[row]] = False
        rows = rows[np.all(free[triples[rows]], axis=1)]
    return taken


def _areas(points_in_obj: Array, triples: NDArray[np.int64]) -> Array:
    """(m,) areas of (m, 3) triangles."""
    a, b, c = (points_in_obj[triples[:, i]] for i in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
