"""How far corners scatter, in units of the deviations that their own pixels state.

What the pixels' noise cannot tell is in here: rounding that runs along an edge, and what a corner's model leaves out.
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array

PRIOR_FREEDOM = 10.0  # degrees of freedom with which the pixels' own noise counts against the corners' scatter
SMOOTH_SHARE = 1.0 / 3.0  # of the corners' coordinates that may tell a smooth misfit of the map
MOST_DEGREE = 5  # of its polynomials along the board


def scatter_of_neighbours(at: Array, missed: Array, covariance: Array, slopes: Array) -> float:
    """Factor of the covariances of corners, from what their distances from a map do not share with their neighbours'.

    Where a board is bent or misprinted, or moves while rows are read, the map misses all corners of a region alike:
    that is no error of a corner. So polynomials along the board are fitted with the map's parameters, of a degree
    that leaves most of the freedom to the scatter.

    at: (n, 2) squares. missed: (n, 2) px from the map. covariance: (n, 2, 2) px^2. slopes: (n, 2, k) of the map.
    """
    smooth = np.concatenate((slopes, polynomials(at)), axis=2)
    square, free = _squares(smooth, missed, covariance)
    if square > free:
        return (square + PRIOR_FREEDOM) / (free + PRIOR_FREEDOM)
    return _narrowed(*_squares(slopes, missed, covariance))


def _narrowed(square: float, free: float) -> float:
    """Factor where corners scatter less than their pixels say: what these show beyond the model moves no corner.

    A tone curve, for instance, changes all edges alike. How much of what is seen is of that kind the pixels do not
    tell; so where the scatter is known well, only their order of magnitude counts beside it. What a smooth misfit
    explains is no reason to state less: a wrong corner at the board's border may be among it.
    """
    if square >= free:
        return 1.0
    beside = (square + PRIOR_FREEDOM) / (free + PRIOR_FREEDOM)
    return min(beside, (square / free) ** max(1.0 - PRIOR_FREEDOM / free, 0.0))


def scatter_about(slopes: Array, missed: Array, covariance: Array) -> float:
    """Mean square of the corners' distances from their map, in units of their covariances; see above."""
    square, free = _squares(slopes, missed, covariance)
    return square / free


def leverage(slopes: Array) -> Array:
    """(m,) diagonal of the hat matrix of (m, k) rows, of which some columns may say the same."""
    return np.sum(orthonormal(slopes) ** 2, axis=1)


def _squares(slopes: Array, missed: Array, covariance: Array) -> tuple[float, float]:
    """Sum of squares, over the covariances, of what no parameters explain, and its degrees of freedom."""
    whitener = np.linalg.cholesky(np.linalg.inv(covariance)).transpose(0, 2, 1)
    residuals = (whitener @ missed[..., None]).ravel()
    span = orthonormal((whitener @ slopes).reshape(len(residuals), -1))
    left = residuals - span @ (span.T @ residuals)
    return float(left @ left), float(len(residuals) - span.shape[1])


def polynomials(at: Array) -> Array:
    """(n, 2, k) both coordinates moved by every product of powers of the places up to a degree."""
    low, high = at.min(axis=0), at.max(axis=0)
    x, y = (2.0 * (at - low) / np.maximum(high - low, 1e-9) - 1.0).T
    most, degree = SMOOTH_SHARE * 2 * len(at), 1
    while degree < MOST_DEGREE and (degree + 2) * (degree + 3) <= most:
        degree += 1
    terms = np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)
    return np.einsum("nt,ck->nctk", terms, np.eye(2)).reshape(len(at), 2, -1)


def orthonormal(slopes: Array) -> Array:
    """(m, r) orthonormal columns that span those of (m, k), of which some may say the same."""
    size = np.linalg.norm(slopes, axis=0)
    left, singular, _ = np.linalg.svd(slopes / np.where(size > 0.0, size, 1.0), full_matrices=False)
    return left[:, singular > 1e-9 * singular[0]]
