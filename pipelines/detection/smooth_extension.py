"""Corners that a map misses, against a smooth extension of it: a bent sheet, or rows that are read one after another.

A map that cannot follow the board misses its outermost corners most, and the map through the others, which is not held
there, misses them far more. What tells a wrong corner then is what the misses of the others leave of its own: they
change smoothly along the board.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from eposit.arrays import Array
from pipelines.detection.corner_scatter import orthonormal

MOST_DEGREE = 7  # of polynomials along the board
MOST_TERMS = 0.7  # of the corners that tell them
LARGE_MISFIT = 2.0  # times what is left of the misses: a smaller misfit of the map is none


class Extension(NamedTuple):
    """What polynomials through the misses of some corners say of others."""

    missed: Array  # (k, 2) px of the others, what is left of their misses
    spread: Array  # (k,) by what factor that scatters more than a corner's own error
    typical: float  # px, median of what is left of a corner's miss where the polynomials go through the others alone


def smooth_extension(at: Array, missed: Array, others: Array, missed_others: Array, usual: float) -> Extension | None:
    """Polynomials of the degree that predicts the corners best, each from the others; None where the map is good.

    at: (n, 2) squares. missed: (n, 2) px from a map. others: (k, 2) squares. missed_others: (k, 2) px. usual: median
    distance, px, of the corners from the map through the others alone.
    """
    best: Extension | None = None
    typical = usual / LARGE_MISFIT
    low, high = at.min(axis=0), at.max(axis=0)
    places, beyond = (2.0 * (v - low) / np.maximum(high - low, 1e-9) - 1.0 for v in (at, others))
    for degree in range(1, MOST_DEGREE + 1):
        if (degree + 1) * (degree + 2) / 2 > MOST_TERMS * len(at):
            break
        terms = _terms(places, degree)
        span = orthonormal(terms)
        left = (missed - span @ (span.T @ missed)) / np.maximum(1.0 - np.sum(span**2, axis=1), 1e-3)[:, None]
        now = float(np.median(np.linalg.norm(left, axis=1)))
        if now < typical:
            typical, own = now, _terms(beyond, degree) @ np.linalg.pinv(terms)
            best = Extension(missed_others - own @ missed, np.sqrt(1.0 + np.sum(own**2, axis=1)), typical)
    return best


def _terms(places: Array, degree: int) -> Array:
    """(n, k) products of powers of (n, 2) places."""
    x, y = places.T
    return np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)
