"""The two loops over pixels: the picture of a light, and the sums of weighted least squares.

A pixel depends on the fields at the four nodes around it only, so sums are kept for each cell of the grid: 12 unknowns
of light (node by node, white, black, behind) beside 7 of shape (six of the pose, the point spread's width).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.kernels import compiled

SHAPE, LIGHT = 7, 12  # unknowns of the shape, and of the light in a cell


class Sums(NamedTuple):
    """Sums over the pixels of each cell of the grid."""

    shape: Array  # (cells, 7, 7), upper triangles
    cross: Array  # (cells, 12, 7)
    light: Array  # (cells, 12, 12), upper triangles
    right: Array  # (cells, 7)
    light_right: Array  # (cells, 12)

    @staticmethod
    def zero(cells: int) -> Sums:
        """Of no pixels."""
        return Sums(
            np.zeros((cells, SHAPE, SHAPE)),
            np.zeros((cells, LIGHT, SHAPE)),
            np.zeros((cells, LIGHT, LIGHT)),
            np.zeros((cells, SHAPE)),
            np.zeros((cells, LIGHT)),
        )


@compiled
def light_picture(
    white: Array,
    target: Array,
    cells: NDArray[np.int64],
    shares: Array,
    columns: int,
    fields: Array,
    out: Array,
) -> None:
    """Grey values before the point spread, to `out` (n,).

    white, target: (n,) shares of pixels. fields: (nodes, 3).
    """
    for p in range(white.size):
        first = cells[p] + cells[p] // (columns - 1)
        value = 0.0
        for corner in range(4):
            node = first + (corner & 1) + (corner >> 1) * columns
            of_white, of_black, behind = fields[node, 0], fields[node, 1], fields[node, 2]
            mixed = of_white * white[p] + of_black * (target[p] - white[p]) + behind * (1.0 - target[p])
            value += shares[p, corner] * mixed
        out[p] = value


@compiled
def accumulate(
    used: NDArray[np.int64],
    weights: Array,
    residuals: Array,
    channels: Array,
    flow: Array,
    cells: NDArray[np.int64],
    shares: Array,
    sums: Sums,
) -> None:
    """Add each used pixel's part to the sums of weighted least squares.

    used: (m,) pixels. weights, residuals: (m,). channels: (5, n) share of white and of target after the point spread,
    the picture's derivatives along x, along y and with the width. flow: (2, 6, n).
    """
    slopes, basis = np.empty(7), np.empty(12)
    for i in range(used.size):
        p, weight, residual = used[i], weights[i], residuals[i]
        if weight == 0.0:
            continue
        cell = cells[p]
        along_x, along_y = channels[2, p], channels[3, p]
        for k in range(6):
            slopes[k] = -(along_x * flow[0, k, p] + along_y * flow[1, k, p])
        slopes[6] = channels[4, p]
        for corner in range(4):
            share = shares[p, corner]
            basis[3 * corner] = share * channels[0, p]
            basis[3 * corner + 1] = share * (channels[1, p] - channels[0, p])
            basis[3 * corner + 2] = share * (1.0 - channels[1, p])
        for k in range(7):
            part = weight * slopes[k]
            sums.right[cell, k] += part * residual
            for j in range(k, 7):
                sums.shape[cell, k, j] += part * slopes[j]
        for k in range(12):
            part = weight * basis[k]
            if part == 0.0:
                continue
            sums.light_right[cell, k] += part * residual
            for j in range(7):
                sums.cross[cell, k, j] += part * slopes[j]
            for j in range(k, 12):
                sums.light[cell, k, j] += part * basis[j]


def prepare() -> None:
    """Call each compiled function once."""
    one, none = np.zeros(1), np.zeros(1, np.int64)
    light_picture(np.zeros(1, np.float32), np.zeros(1, np.float32), none, np.zeros((1, 4)), 2, np.zeros((4, 3)), one)
    flow = np.zeros((2, SHAPE - 1, 1))
    accumulate(none, one, one, np.zeros((5, 1)), flow, none, np.zeros((1, 4)), Sums.zero(1))
