"""Names of array types, and what NumPy lacks for arrays that are long in their last axis.

The layout of arrays: users give and get the problems first, (b, n, 2) and (b, 3, 3). Inside, `posit`, `refine`,
`starts`, `robust` and the methods built on them have the problems last, (n, 2, b) and (3, 3, b): one NumPy call then
works on one number of every problem in a row of memory. Where LAPACK or matmul do the work on stacks of matrices, which
NumPy takes in the first axes, problems are first inside, too: `opnp` and the results in `unknown_camera`.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.floating]
Mask = NDArray[np.bool_]


def as_numbers(values: ArrayLike, name: str) -> Array:
    """As a contiguous array of float64; NaN where a masked array is masked. name: of the argument, for the message.

    Raises:
        ValueError: what is no array of real numbers: texts, times, complex numbers, rows of different lengths.
    """
    if type(values) is np.ndarray and values.dtype == np.float64:
        return values if values.flags.c_contiguous else values.copy()
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "fiubO":
            raise TypeError
        with np.errstate(over="ignore"):
            numbers = np.asarray(array, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError):
        what = f"an array of {values.dtype}" if isinstance(values, np.ndarray) else f"a {type(values).__name__}"
        raise ValueError(f"{name} is {what} that has other things than real numbers; give an array of these") from None
    if isinstance(values, np.ma.MaskedArray):
        return np.where(np.ma.getmaskarray(values), np.nan, numbers)
    return numbers


def shown(value: object) -> str:
    """A wrong argument for a message, which is to stay a sentence."""
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else f"{text[:50]} ... ({type(value).__name__})"


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
