"""Whether residuals contradict the standard deviations that were stated for them."""

from __future__ import annotations

from typing import overload

from eposit.arrays import Array

CONTRADICTION = 5.0  # standard deviations of a chi-square's cube root: one right fit in 3 million lies above


@overload
def chi_square_limit(freedom: float) -> float: ...


@overload
def chi_square_limit(freedom: Array) -> Array: ...


def chi_square_limit(freedom: float | Array) -> float | Array:
    """The sum of squared residuals over their variances above which they contradict them, for 1 freedom or more.

    Source:
        Wilson and Hilferty 1931: the cube root of a chi-square over its freedom is nearly normal.
    """
    share = 2.0 / (9.0 * freedom)
    return freedom * (1.0 - share + CONTRADICTION * share**0.5) ** 3
