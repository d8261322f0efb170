"""Rows of a picture moved against each other, as by a camera that shakes while they are read one after another.

A map and polynomials along the board do not follow a shake that is only a few squares long, and take it for errors of
the corners. But all that lies in one row moves alike: the shake is two functions of the row alone, which corners in
many rows tell well. They bend the edges as well.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap, normal_angles
from pipelines.detection.corner_scatter import orthonormal, polynomials

POWERS = 2  # of the row, up to the second: half waves alone have no slope at the first and the last row
LEAST_FUNCTIONS = 6  # slower moves are left to the map and the polynomials
PLACES_PER_FUNCTION, MOST_FUNCTIONS = 3.0, 30  # corners for each, so that two thirds of the coordinates are left to the
# map and the scatter; more waves than so many halves over a board are no camera's, and cost time
LEAST_MISSED = 10.0  # deviations by which the map misses corners: less is no shake
LEAST_GAIN = 5.0  # times by which the map and polynomials miss corners more than functions of the row: no scatter gives
# such a ratio, and no bent board, whose bend is smooth along it
LEAST_NEW = 0.1  # of a function, that the map and slower ones do not say in the corners' rows: where they lie in a few
# rows, as on a board that stands upright, nothing tells how those between are moved
SHAKE_PX = 2.0  # spread of what each function moves rows by; what is more, and smooth, the map does as well
SAME = 1e-9  # of the largest singular value: what is less is said twice, by the map and by the functions


class RowMoves(NamedTuple):
    """How far rows are moved, as sums of functions of the row."""

    first: float  # of the corners' rows, px
    extent: float  # of them, px
    moved: Array  # (k, 2) px, of each function
    unsure: Array  # (2 k, m); times its transpose: the covariance of `moved`

    def terms(self, rows: Array) -> Array:
        """(n, 2, 2 k) both coordinates moved by each function of rows (n,) px."""
        return _both(_functions(self._at(rows), len(self.moved)))

    def __call__(self, rows: Array) -> Array:
        """(n, 2) px by which rows (n,) px are moved."""
        return self.terms(rows) @ self.moved.ravel()

    def bends(self, rows: Array, jacobian: Array) -> Array:
        """(n, 2) what the moves add to the coefficients of t^2 of `BoardMap.edge_forms` at corners in rows (n,) px.

        jacobian: (n, 2, 2) of the map.
        """
        return self._bend_terms(rows, jacobian) @ self.moved.ravel()

    def form_errors(self, rows: Array, jacobian: Array, pull_px2: Array) -> Array:
        """(n, 2, 2) covariances, px^2, of what the unsure bends move corners by.

        pull_px2: (n,) by how much an edge's bend, as in `bends`, moves it in a corner's fit.
        """
        heights = self._bend_terms(rows, jacobian) @ self.unsure * pull_px2[:, None, None]
        moved = np.linalg.solve(_normals(jacobian), heights)
        return moved @ moved.transpose(0, 2, 1)

    def _bend_terms(self, rows: Array, jacobian: Array) -> Array:
        """(n, 2, 2 k) of `bends` for each of the functions: an edge of slope s runs through s rows in each px."""
        second = _second_derivatives(self._at(rows), len(self.moved)) / self.extent**2
        normals = _normals(jacobian)
        return 0.5 * normals[..., :1] ** 2 * (normals @ _both(second))

    def _at(self, rows: Array) -> Array:
        return (rows - self.first) / self.extent


def row_moves(at: Array, points_px: Array, covariance: Array, board: BoardMap) -> RowMoves | None:
    """The moves of rows that corners at (n, 2) squares show; None where nothing tells of any.

    points_px: (n, 2). covariance: (n, 2, 2) px^2. board: the map that misses them.
    """
    most = min(int(len(at) / PLACES_PER_FUNCTION), MOST_FUNCTIONS)
    if most <= LEAST_FUNCTIONS:
        return None
    whitener = np.linalg.cholesky(np.linalg.inv(covariance)).transpose(0, 2, 1)
    missed = (whitener @ (points_px - board(at))[..., None]).ravel()
    rows, slopes = points_px[:, 1], whitener @ board.slopes(at)
    first, extent = float(rows.min()), float(np.ptp(rows))
    if np.sqrt(np.mean(missed**2)) < LEAST_MISSED or extent <= 0.0:
        return None
    best = _unpredicted(orthonormal(_flat(slopes, whitener @ polynomials(at))), missed) / LEAST_GAIN
    terms = whitener @ _both(_functions((rows - first) / extent, most))
    span, count = orthonormal(_flat(slopes, terms[..., : 2 * LEAST_FUNCTIONS])), 0
    for tried in range(LEAST_FUNCTIONS + 1, most + 1):
        more = _beside(span, _flat(terms[..., 2 * tried - 2 : 2 * tried]))
        if more is None:
            break
        span = np.hstack((span, more))
        left = _unpredicted(span, missed)
        if left < best:
            best, count = left, tried
    if not count:
        return None
    both, scatter = _flat(terms[..., : 2 * count], slopes), max(best, 1.0)
    held = np.eye(2 * count, both.shape[1]) / SHAKE_PX
    unsure = np.linalg.pinv(np.vstack((both / scatter, held)), rcond=SAME)[: 2 * count]
    return RowMoves(first, extent, (unsure[:, : len(both)] @ missed / scatter).reshape(-1, 2), unsure)


def _flat(*parts: Array) -> Array:
    """(2 n, k) columns of parts (n, 2, k), side by side."""
    return np.concatenate(parts, axis=2).reshape(2 * len(parts[0]), -1)


def _beside(span: Array, columns: Array) -> Array | None:
    """(m, j) orthonormal columns of what columns (m, j) have beside the orthonormal ones of `span`; None if little."""
    left = columns - span @ (span.T @ columns)
    if np.any(np.linalg.norm(left, axis=0) < LEAST_NEW * np.linalg.norm(columns, axis=0)):
        return None
    left -= span @ (span.T @ left)  # again, as the first time leaves rounding of what was large
    return np.linalg.qr(left)[0]


def _functions(at: Array, count: int) -> Array:
    """(n, count) functions of places (n,) from 0 to 1: powers, and cosines of one half wave, two, and so on."""
    powers, turns = np.arange(POWERS + 1), np.pi * np.arange(1, count - POWERS)
    return np.hstack((at[:, None] ** powers, np.cos(turns * at[:, None])))


def _second_derivatives(at: Array, count: int) -> Array:
    """(n, count) of `_functions`."""
    powers, turns = np.arange(POWERS + 1), np.pi * np.arange(1, count - POWERS)
    curved = powers * (powers - 1) * at[:, None] ** np.maximum(powers - 2, 0)
    return np.hstack((curved, -(turns**2) * np.cos(turns * at[:, None])))


def _both(values: Array) -> Array:
    """(n, 2, 2 k) either coordinate moved by values (n, k)."""
    return np.einsum("nt,ck->nctk", values, np.eye(2)).reshape(len(values), 2, -1)


def _normals(jacobian: Array) -> Array:
    """(n, 2, 2) of the images of lines along y and along x, one a row."""
    angles = normal_angles(jacobian)
    return np.stack((np.cos(angles), np.sin(angles)), axis=-1)


def _unpredicted(span: Array, missed: Array) -> float:
    """Root of the mean square of misses (m,) of which each is predicted, along orthonormal columns, by the others."""
    left = (missed - span @ (span.T @ missed)) / np.maximum(1.0 - np.sum(span**2, axis=1), 1e-3)
    return float(np.sqrt(np.mean(left**2)))
