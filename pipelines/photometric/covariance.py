"""The covariance of a refined shape: by the noise alone, and by how much the board's parts contradict each other.

The inverse of the information holds where the model is true and noise is independent from pixel to pixel. Light that
the grid does not follow, dirt, texture and noise that the point spread has blurred are neither. Their part in the pose
shows: each cell of the grid pulls at the pose with its own residuals, and the scatter of these pulls tells the
variance, whatever the residuals in a cell have in common.

A cell that says much of the pose bends it towards its own residuals, which then look smaller than they were; each pull
is scaled by what its cell leaves to the others.

Source:
    White, Econometrica 48 (1980), 817: the sandwich covariance; Liang and Zeger, Biometrika 73 (1986), 13: of clusters;
    Bell and McCaffrey, Survey Methodology 28 (2002), 169: the scale of a cluster's residuals.
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.photometric.kernels import Sums
from pipelines.photometric.light_grid import LightGrid
from pipelines.photometric.normal_equations import Step, symmetric, unknowns

MOST_LEVERAGE = 0.9  # of a cell on a direction of the shape; with more there is nothing to compare it with


def sandwich(sums: Sums, step: Step, grid: LightGrid) -> Array:
    """(7, 7) covariance of the shape, from cells of the grid as clusters. sums, step: of the last iteration."""
    by_light = step.light_of_shape[unknowns(grid)]  # (cells, 12, 7)
    to_light = np.swapaxes(by_light, 1, 2)
    pulls = sums.right + np.einsum("ckj,ck->cj", by_light, sums.light_right)
    mixed = to_light @ sums.cross
    information = symmetric(sums.shape) + mixed + np.swapaxes(mixed, 1, 2) + to_light @ symmetric(sums.light) @ by_light
    lower = np.linalg.cholesky(step.covariance)
    leverage, directions = np.linalg.eigh(lower.T @ information @ lower)
    own = np.einsum("cjk,cj->ck", directions, pulls @ lower)
    own /= np.sqrt(1.0 - np.clip(leverage, 0.0, MOST_LEVERAGE))
    moved = np.einsum("cjk,ck->cj", directions, own) @ lower.T
    return moved.T @ moved


def at_least(least: Array, other: Array) -> Array:
    """The smallest covariance (k, k) that is as large as `least` in every direction, and as `other` in its own."""
    lower = np.linalg.cholesky(least)
    inverse = np.linalg.inv(lower)
    values, vectors = np.linalg.eigh(inverse @ other @ inverse.T)
    half = lower @ vectors
    return (half * np.maximum(values, 1.0)) @ half.T
