"""Names of array types, and the one product that NumPy lacks for coordinates-first arrays."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]
Mask = NDArray[np.bool_]


def cross(a: Array, b: Array) -> Array:
    """Cross product along the first axis, (3, ...) with (3, ...)."""
    return np.stack((a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]))
