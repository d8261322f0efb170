"""Intervals of medians, percentiles, means and rates: every score says how well it is known."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from eposit.arrays import Array, Mask

RESAMPLES = 1000
FEW = 200  # resamples where a table has many scores: an interval's ends are good to a tenth of its length
LEVEL = 0.95
LEAST_FOR_TAIL = 72  # units: 0.95^72 is below 2.5 %, the chance that all lie below their 95th percentile
CHUNK_VALUES = 500_000  # resampled values held at once


@dataclass(frozen=True, slots=True)
class Interval:
    """A score and its 95 % bootstrap interval."""

    value: float
    low: float
    high: float

    def text(self, digits: int = 3, unit: str = "") -> str:
        """`1.23 [1.2, 1.27]`, to significant digits."""
        shown = f"{self.value:.{digits}g} [{self.low:.{digits}g}, {self.high:.{digits}g}]"
        return f"{shown} {unit}".rstrip()


def bootstrap(
    values: Array, statistic: Callable[[Array], Array], seed: int = 0, resamples: int = RESAMPLES
) -> Interval:
    """Percentile bootstrap over the first axis of `values`, which are independent units: frames, or seeds.

    values: (n,) or (n, k), k values of one unit, which stay together; NaN values take no part. statistic: from (r, m)
    values, some NaN, to (r,), such as `median`.

    Returns:
        NaN throughout where there is nothing to resample.
    Source:
        Efron and Tibshirani 1993, An Introduction to the Bootstrap, section 13.3.
    """
    units = np.asarray(values, np.float64)
    if not units.size or np.all(np.isnan(units)):
        return Interval(np.nan, np.nan, np.nan)
    units = units.reshape(len(units), -1)
    value = float(statistic(units.reshape(1, -1))[0])
    if len(units) == 1:
        return Interval(value, value, value)

    def of_units(chosen: NDArray[np.int64], axis: int) -> Array:
        drawn = units[np.atleast_2d(chosen)]  # axis is the last, over the units
        found = statistic(drawn.reshape(len(drawn), -1))
        return found if chosen.ndim > 1 else found[0]

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a draw of failures only has no score
        drawn = stats.bootstrap(
            (np.arange(len(units)),), of_units, n_resamples=resamples, batch=max(1, CHUNK_VALUES // units.size),
            vectorized=True, method="percentile", random_state=np.random.default_rng(seed),
        )  # fmt: skip
    # SciPy's own interval is NaN where one draw is.
    low, high = np.nanquantile(drawn.bootstrap_distribution, [(1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0])
    return Interval(value, float(low), float(high))


def median(values: Array) -> Array:
    """(r, m) to (r,), NaN left out."""
    return np.nanmedian(values, axis=1)


def percentile95(values: Array) -> Array:
    """(r, m) to (r,), NaN left out."""
    return np.nanpercentile(values, 95.0, axis=1)


def mean(values: Array) -> Array:
    """(r, m) to (r,), NaN left out: of failures as 0 and 1, a rate."""
    return np.nanmean(values, axis=1)


def student(values: Array, level: float = LEVEL) -> Interval:
    """Mean of independent values, (n,), with Student's interval (Student 1908); NaN values take no part.

    Returns:
        An infinite interval around a single value, NaN throughout without any.
    """
    known = values[np.isfinite(values)]
    if not known.size:
        return Interval(np.nan, np.nan, np.nan)
    value = float(np.mean(known))
    if known.size == 1:
        return Interval(value, -np.inf, np.inf)
    half = float(stats.t.ppf((1.0 + level) / 2.0, known.size - 1) * np.std(known, ddof=1) / np.sqrt(known.size))
    return Interval(value, value - half, value + half)


def root(found: Interval) -> Interval:
    """Of a mean square with its interval; an end below zero is zero."""
    return Interval(*(float(np.sqrt(max(end, 0.0))) for end in (found.value, found.low, found.high)))


def tail(values: Array) -> Interval | None:
    """95th percentile of (n,) or (n, k) values, k of one unit, with the interval that order statistics give it.

    It holds for any distribution; the values of a unit may depend on each other in any way that leaves each of k sets
    of n like the others. NaN values take no part, nor units that have no other.

    Returns:
        None below `LEAST_FOR_TAIL` units: even the largest value is then below the percentile too often.
    Source:
        Conover 1999, Practical Nonparametric Statistics, section 3.2.
    """
    units = values.reshape(len(values), -1)
    n = int(np.sum(np.any(np.isfinite(units), axis=1)))
    if n < LEAST_FOR_TAIL:
        return None
    ordered = np.sort(units[np.isfinite(units)])
    first, last = (int(stats.binom.ppf(part, n, 0.95)) for part in ((1.0 - LEVEL) / 2.0, (1.0 + LEVEL) / 2.0))
    low, high = (first - 1) * len(ordered) // n, -(-(last + 1) * len(ordered) // n) - 1
    return Interval(float(np.percentile(ordered, 95.0)), float(ordered[low]), float(ordered[high]))


def rate(happened: Mask) -> Interval:
    """Share of true values, (n,) or (n, k), with the bootstrap's interval over the first axis.

    Where all are alike a bootstrap knows no scatter: then it is Wilson's interval over the values.
    """
    if np.all(happened) or not np.any(happened):
        return wilson(happened.ravel())
    return bootstrap(happened.astype(np.float64), mean, resamples=FEW)


def wilson(happened: Mask) -> Interval:
    """Share of true values that are independent of each other, with Wilson's interval (Wilson 1927)."""
    n, count = len(happened), int(np.sum(happened))
    found = stats.binomtest(count, n).proportion_ci(LEVEL, method="wilson")
    return Interval(count / n, float(found.low), float(found.high))


def percent(value: Interval, digits: int = 1) -> str:
    """`95.0 [94.6, 95.3] %`."""
    shown = [f"{100.0 * number:.{digits}f}" for number in (value.value, value.low, value.high)]
    return f"{shown[0]} [{shown[1]}, {shown[2]}] %"


def squares_over(covariances: Array, errors: Array) -> Array:
    """(n,) e^T C^-1 e of errors (n, k) and their covariances (n, k, k); NaN where a covariance is singular."""

    def squares(c: Array, e: Array) -> Array:
        return np.sum(e * np.linalg.solve(c, e[..., None])[..., 0], axis=1)

    return _where_possible(squares, covariances, errors)


def whitened(covariances: Array, errors: Array) -> Array:
    """(n, k) L^-1 e with L L^T the covariances (n, k, k) of errors (n, k); NaN where one is not positive definite."""

    def divided(c: Array, e: Array) -> Array:
        return np.linalg.solve(np.linalg.cholesky(c), e[..., None])[..., 0]

    return _where_possible(divided, covariances, errors)


def _where_possible(divided: Callable[[Array, Array], Array], covariances: Array, errors: Array) -> Array:
    """What `divided` gives, one by one and NaN where it cannot: NumPy refuses all matrices if one is singular."""
    try:
        return divided(covariances, errors)
    except np.linalg.LinAlgError:
        if len(errors) == 1:
            return np.full_like(divided(np.eye(errors.shape[1])[None], errors), np.nan)
        alone = (slice(i, i + 1) for i in range(len(errors)))
        return np.concatenate([_where_possible(divided, covariances[i], errors[i]) for i in alone])
