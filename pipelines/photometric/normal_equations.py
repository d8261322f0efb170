"""Weighted least squares of shape and light together: the light, which has hundreds of unknowns, is eliminated."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from eposit.arrays import Array
from pipelines.photometric.kernels import LIGHT, SHAPE, Sums
from pipelines.photometric.light_grid import FIELDS, SMOOTH_GREY, LightGrid

RIDGE = 1e-12  # of the largest diagonal: keeps a grid of which nothing is seen regular


class Step(NamedTuple):
    """The solution of the normal equations."""

    shape: Array  # (7,) change of the shape
    fields: Array  # (nodes, 3) change of the light
    covariance: Array  # (7, 7) of the shape with the light unknown, for weights that are inverse variances
    light_of_shape: Array  # (nodes * 3, 7) least-squares change of the light for a change of the shape


def solve_light(sums: Sums, grid: LightGrid, fields: Array) -> Array:
    """(nodes, 3) change of the light alone."""
    factor, _, right = _light_system(sums, grid, fields)
    return cho_solve_banded((factor, True), right).reshape(-1, FIELDS)


def solve(sums: Sums, grid: LightGrid, fields: Array) -> Step:
    """The step of shape and light.

    Raises:
        numpy.linalg.LinAlgError: the pixels do not determine the shape.
    """
    factor, cross, light_right = _light_system(sums, grid, fields)
    light_of_shape = -cho_solve_banded((factor, True), cross)
    information = symmetric(sums.shape.sum(axis=0)) + cross.T @ light_of_shape
    scale = np.sqrt(np.diag(information))
    if not np.all(np.isfinite(scale) & (scale > 0.0)):
        raise np.linalg.LinAlgError("the pixels do not determine the pose")
    covariance = np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale)
    shape = covariance @ (sums.right.sum(axis=0) + light_of_shape.T @ light_right)
    light = cho_solve_banded((factor, True), light_right) + light_of_shape @ shape
    return Step(shape, light.reshape(-1, FIELDS), covariance, light_of_shape)


def symmetric(upper: Array) -> Array:
    """Whole matrices (..., k, k) of their upper triangles, what is below them being 0."""
    return upper + np.swapaxes(np.triu(upper, 1), -1, -2)


def unknowns(grid: LightGrid) -> NDArray[np.int64]:
    """(cells, 12) numbers of a cell's unknowns among all of the light's."""
    return (FIELDS * grid.nodes()[:, :, None] + np.arange(FIELDS)).reshape(-1, LIGHT)


def _light_system(sums: Sums, grid: LightGrid, fields: Array) -> tuple[Array, Array, Array]:
    """Cholesky factor of the light's banded matrix (lower form), its products with the shape, and its right side.

    Neighbouring nodes are tied loosely, so that a node without pixels goes by its neighbours.
    """
    own, count = unknowns(grid), FIELDS * grid.node_count
    right, cross = np.zeros(count), np.zeros((count, SHAPE))
    np.add.at(right, own, sums.light_right)
    np.add.at(cross, own, sums.cross)
    band = np.zeros((FIELDS * (grid.columns + 2), count))
    k, j = np.triu_indices(LIGHT)
    np.add.at(band, (own[:, j] - own[:, k], own[:, k]), sums.light[:, k, j])
    _tie_neighbours(band, right, grid, fields)
    band[0] += RIDGE * band[0].max()
    return cholesky_banded(band, lower=True), cross, right


def _tie_neighbours(band: Array, right: Array, grid: LightGrid, fields: Array) -> None:
    strength = 1.0 / SMOOTH_GREY**2
    pairs = grid.neighbours()
    for field in range(FIELDS):
        one, other = (FIELDS * pairs + field).T
        pull = strength * (fields[pairs[:, 0], field] - fields[pairs[:, 1], field])
        np.add.at(band[0], one, strength)
        np.add.at(band[0], other, strength)
        np.add.at(band, (other - one, one), -strength)
        np.add.at(right, one, -pull)
        np.add.at(right, other, pull)
