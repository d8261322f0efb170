"""How much a place of a level looks like a corner of a chessboard with sides of given length and direction."""

from __future__ import annotations

import math

import numpy as np

from eposit.arrays import Array
from pipelines.detection.kernels import compiled, compiled_part
from pipelines.detection.sampling import Level, grey_at

TEMPLATE = (-0.34, -0.23, -0.12, 0.12, 0.23, 0.34)  # squares from a corner, along x and y
SEARCH = (-0.24, -0.12, 0.0, 0.12, 0.24)  # squares around the place where a corner is expected, along x and y
LEAST_SPREAD = 1e-6  # grey levels


def likeness(level: Level, places: Array, along_x: Array, along_y: Array, signs: Array) -> tuple[Array, Array]:
    """How much (n, 2) places look like corners of a chessboard, and with which contrast.

    along_x, along_y: (n, 2) px, sides of the squares. signs: (n,) 1 where the square of positive steps is white, else
    -1. Returns (n,) correlations, up to 1, and (n,) half differences between white and black, grey levels; NaN where
    the picture ends.
    """
    like, contrast = np.empty(len(places)), np.empty(len(places))
    _likeness_of_all(level, places, along_x, along_y, signs, like, contrast)
    return like, contrast


def most_likely(level: Level, places: Array, along_x: Array, along_y: Array, signs: Array) -> Array:
    """(n, 2) px of what looks most like a corner around (n, 2) px; the arguments are those of `likeness`."""
    out = np.empty(places.shape)
    _most_likely_of_all(level, places, along_x, along_y, signs, out)
    return out


@compiled_part
def _look(
    level: Level, x: float, y: float, ax: float, ay: float, bx: float, by: float, sign: float
) -> tuple[float, float]:
    """Correlation with a corner, and half the difference between white and black, at one place with sides a and b."""
    total, square, difference, count = 0.0, 0.0, 0.0, 0
    first = grey_at(level, x, y)  # grey values count from here, so that their squares lose no digits
    for v in TEMPLATE:
        for u in TEMPLATE:
            grey = grey_at(level, x + u * ax + v * bx, y + u * ay + v * by) - first
            total += grey
            square += grey * grey
            difference += grey if u * v > 0.0 else -grey
            count += 1
    mean = total / count
    variance = square / count - mean * mean
    contrast = sign * difference / count
    return contrast / max(math.sqrt(max(variance, 0.0)), LEAST_SPREAD), contrast


@compiled
def _likeness_of_all(
    level: Level, places: Array, along_x: Array, along_y: Array, signs: Array, like: Array, contrast: Array
) -> None:
    for i in range(len(places)):
        like[i], contrast[i] = _look(
            level, places[i, 0], places[i, 1], along_x[i, 0], along_x[i, 1], along_y[i, 0], along_y[i, 1], signs[i]
        )


@compiled
def _most_likely_of_all(level: Level, places: Array, along_x: Array, along_y: Array, signs: Array, out: Array) -> None:
    for i in range(len(places)):
        ax, ay, bx, by = along_x[i, 0], along_x[i, 1], along_y[i, 0], along_y[i, 1]
        most = -np.inf
        for v in SEARCH:
            for u in SEARCH:
                x, y = places[i, 0] + u * ax + v * bx, places[i, 1] + u * ay + v * by
                like = _look(level, x, y, ax, ay, bx, by, signs[i])[0]
                like = -1.0 if math.isnan(like) else like
                if like > most:
                    most = like
                    out[i, 0], out[i, 1] = x, y


def prepare() -> None:
    """Call each compiled function once."""
    level, at, sign = np.zeros((2, 2), np.float32), np.zeros((1, 2)), np.ones(1)
    likeness(level, at, at, at, sign)
    most_likely(level, at, at, at, sign)
