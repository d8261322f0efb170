"""Symmetric systems of six equations, many at once, problems last: elimination written out over NumPy rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eposit.arrays import Array

LEAST_PIVOT = 1e-15  # of a matrix with a unit diagonal: below it the matrix has no inverse in double precision


@dataclass(frozen=True, slots=True)
class Factor:
    """N = U^T D U with unit upper triangles."""

    upper: Array  # (6, 6, b), the part above the diagonal
    pivots: Array  # (6, b), diagonal of 1 / D
    relative: Array  # (b,) least pivot over its diagonal entry: not above LEAST_PIVOT where N has no inverse


def factorise(normal: Array, damping: Array | float = 0.0) -> Factor:
    """Factor of (6, 6, b) matrices, upper triangle, with the diagonal grown by `damping` (Marquardt).

    Elimination without pivots is stable for a positive definite matrix, whatever the scales of its rows.
    """
    upper, pivots = np.empty_like(normal), np.empty((6, normal.shape[-1]))
    least = np.full(normal.shape[-1], np.inf)
    for i in range(6):
        upper[i, i:] = normal[i, i:]
        upper[i, i] *= 1.0 + damping
    with np.errstate(all="ignore"):
        for i in range(6):
            np.divide(1.0, upper[i, i], out=pivots[i])
            np.minimum(least, upper[i, i] / normal[i, i], out=least)
            row = upper[i, i + 1 :] * pivots[i]
            for j in range(i + 1, 6):
                upper[j, j:] -= row[j - i - 1] * upper[i, j:]
            upper[i, i + 1 :] = row
    return Factor(upper, pivots, least)


def inverse(factor: Factor) -> Array:
    """(6, 6, b) inverses; NaN where there is none."""
    b = factor.pivots.shape[1]
    with np.errstate(all="ignore"):
        rows = np.zeros((6, 6, b))  # inverse of the unit upper triangle, built from its last row
        for i in range(5, -1, -1):
            rows[i, i] = 1.0
            if i < 5:
                np.einsum("jb,jkb->kb", -factor.upper[i, i + 1 :], rows[i + 1 :, i + 1 :], out=rows[i, i + 1 :])
        result = np.empty((6, 6, b))
        for j in range(6):
            weighted = rows[j, j:] * factor.pivots[j:]
            np.einsum("kb,ikb->ib", weighted, rows[: j + 1, j:], out=result[j, : j + 1])
            result[:j, j] = result[j, :j]
    result[..., ~(factor.relative > LEAST_PIVOT)] = np.nan
    return result
