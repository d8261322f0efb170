"""Single corners that lie farther off than they state, by the corners around them: their distance is their error.

A speck, a hair, a drop or the edge of a thing before the board moves one corner by more than its own pixels tell. Where
that is too little for the corner to be wrong, only the others show it.
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.detection.corner_scatter import orthonormal, polynomials, scatter_of_neighbours

LIMIT = 20.0  # square, in units of its expectation, of a distance from the others that noise does not make: 5e-5 do
MEDIAN = 2.0 * np.log(2.0)  # of such squares, where noise alone makes them: they are exponentially distributed
GOOD_MAP = 1.5  # times that: a map that leaves more misses whole regions, and polynomials are fitted with it
LEAST_FREE = 0.2  # of a corner's squared error that must show beside the others: less is mostly theirs
MOST_SHARE = 0.1  # of the corners; more are no single ones


def stated_errors(at: Array, missed: Array, covariance: Array, slopes: Array) -> tuple[Array, float]:
    """(n, 2, 2) px^2, the covariances scaled by how the corners scatter, and that factor.

    Single corners far from the others are left out of the factor, and have the square of their distance in their own
    covariance. What the others say of a corner is the map fitted without it and, where the map misses the board,
    polynomials along the board. The farthest is taken out first, so that it does not make its neighbours look far off.

    at: (n, 2) squares. missed: (n, 2) px from the map. covariance: (n, 2, 2) px^2. slopes: (n, 2, k) of the map.
    """
    kept, lone, factor = np.arange(len(at)), np.zeros_like(covariance), 1.0
    for count in range(int(MOST_SHARE * len(at)) + 1):
        places, misses, own, along = (part[kept] for part in (at, missed, covariance, slopes))
        factor = scatter_of_neighbours(places, misses, own, along)
        if count == int(MOST_SHARE * len(at)):
            break
        distances, squares = _distances(places, misses, factor * own, along)
        worst = int(np.argmax(squares))
        if squares[worst] <= LIMIT:
            break
        lone[kept[worst]] = np.outer(distances[worst], distances[worst])
        kept = np.delete(kept, worst)
    return factor * covariance + lone, factor


def _distances(at: Array, missed: Array, covariance: Array, slopes: Array) -> tuple[Array, Array]:
    """(n, 2) px, distances of corners from where the others put them, and (n,) their squares in deviations."""
    whitener = np.linalg.cholesky(np.linalg.inv(covariance)).transpose(0, 2, 1)
    off = (whitener @ missed[..., None])[..., 0]
    alone, squares = _from_others(whitener @ slopes, off)
    if np.median(squares) > GOOD_MAP * MEDIAN:
        alone, squares = _from_others(whitener @ np.concatenate((slopes, polynomials(at)), axis=2), off)
    return np.linalg.solve(whitener, alone[..., None])[..., 0], squares


def _from_others(smooth: Array, missed: Array) -> tuple[Array, Array]:
    """(n, 2) distances of corners from where the others put them, and (n,) their squares over what noise makes of them.

    The squares are 0 where the others hardly tell. smooth: (n, 2, k), missed: (n, 2), in the corners' deviations.
    """
    span = orthonormal(smooth.reshape(-1, smooth.shape[-1]))
    left = (missed.ravel() - span @ (span.T @ missed.ravel())).reshape(-1, 2)
    blocks = span.reshape(len(missed), 2, -1)
    free = np.eye(2) - blocks @ blocks.transpose(0, 2, 1)
    told = np.linalg.eigvalsh(free)[:, 0] > LEAST_FREE
    free[~told] = np.eye(2)
    alone = np.linalg.solve(free, left[..., None])[..., 0]
    return alone, np.where(told, np.sum(left * alone, axis=1), 0.0)
