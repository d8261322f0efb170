"""The covariance of a refined shape: by the noise alone, and by how much the board's parts contradict each other.

The inverse of the information holds where the model is true and noise is independent from pixel to pixel. Light that
the grid does not follow, dirt, texture and noise that the point spread has blurred are neither. Their part in the pose
shows: each cell of the grid pulls at the pose with its own residuals, and the scatter of these pulls tells the
variance, whatever the residuals in a cell have in common.

Source:
    White, Econometrica 48 (1980), 817: the sandwich covariance; Liang and Zeger, Biometrika 73 (1986), 13, of clusters.
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.photometric.kernels import Sums
from pipelines.photometric.light_grid import LightGrid
from pipelines.photometric.normal_equations import Step, unknowns


def sandwich(sums: Sums, step: Step, grid: LightGrid) -> Array:
    """(7, 7) covariance of the shape, from cells of the grid as clusters. sums, step: of the last iteration."""
    own = unknowns(grid)
    pulls = sums.right + np.einsum("ck,ckj->cj", sums.light_right, step.light_of_shape[own])
    pulls = pulls[np.any(sums.cross != 0.0, axis=(1, 2))]
    count, shape = pulls.shape
    moved = (pulls - pulls.mean(axis=0)) @ step.covariance
    return moved.T @ moved * (count / max(count - shape, 1))


def at_least(least: Array, other: Array) -> Array:
    """The smallest covariance (k, k) that is as large as `least` in every direction, and as `other` in its own."""
    lower = np.linalg.cholesky(least)
    inverse = np.linalg.inv(lower)
    values, vectors = np.linalg.eigh(inverse @ other @ inverse.T)
    half = lower @ vectors
    return (half * np.maximum(values, 1.0)) @ half.T
