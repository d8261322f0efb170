"""Names of array types, and what NumPy lacks for arrays that are long in their last axis.

The layout of arrays: users give and get the problems first, (b, n, 2) and (b, 3, 3). Inside, `posit`, `refine`,
`starts`, `robust` and the methods built on them have the problems last, (n, 2, b) and (3, 3, b): one NumPy call then
works on one number of every problem in a row of memory. Where LAPACK or matmul do the work on stacks of matrices, which
NumPy takes in the first axes, problems are first inside, too: `opnp` and the results in `unknown_camera`.
"""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating]
Mask = NDArray[np.bool_]


def cross(a: Array, b: Array) -> Array:
    """Cross product along the first axis, (3, ...) with (3, ...)."""
    product = np.empty(np.broadcast_shapes(a.shape, b.shape), np.result_type(a, b))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[j], b[k], out=product[i])
        product[i] -= a[k] * b[j]
    return product


def take_last(values: Array, rows: NDArray[np.int64]) -> Array:
    """values[..., rows]: the same, several times faster."""
    return np.take(values, rows, axis=-1, mode="clip")


def solve_or_nan(matrices: Array, right: Array) -> Array:
    """np.linalg.solve of stacks, NaN for a matrix that is exactly singular."""
    try:
        return np.linalg.solve(matrices, right)
    except np.linalg.LinAlgError:
        if matrices.ndim == 2:
            return np.full_like(right, np.nan)
        right = np.broadcast_to(right, (*matrices.shape[:-2], *right.shape[-2:]))
        return np.stack([solve_or_nan(matrix, side) for matrix, side in zip(matrices, right, strict=True)])
