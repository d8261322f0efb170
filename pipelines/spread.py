"""How the median absolute deviation, which few wrong values cannot change, becomes a standard deviation."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array

NORMAL_MAD = 1.4826  # standard deviations to a median absolute deviation, if values scatter as a gaussian has it


def median_with_error(values: Array) -> tuple[float, float]:
    """The median of some numbers, and its standard error, if they scatter as a gaussian has it."""
    middle = float(np.median(values))
    spread = NORMAL_MAD * float(np.median(np.abs(values - middle)))
    return middle, spread * float(np.sqrt(0.5 * np.pi / len(values)))
