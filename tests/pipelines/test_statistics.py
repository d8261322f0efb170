"""Bootstrap intervals against closed forms."""

import numpy as np
import pytest
from scipy.stats import norm

from pipelines.statistics import (
    LEAST_FOR_TAIL,
    Interval,
    bootstrap,
    mean,
    median,
    percent,
    percentile95,
    rate,
    squares_over,
    student,
    tail,
    wilson,
)


def test_the_interval_of_a_mean_is_that_of_the_normal_distribution():
    values = np.random.default_rng(0).standard_normal(400)
    found = bootstrap(values, mean, resamples=4000)
    half = 1.96 * values.std() / np.sqrt(400)
    assert found.value == pytest.approx(values.mean())
    # An end is a quantile of 4000 draws, good to 3 % of the half width; the skewness of 400 values adds 2.
    assert found.low == pytest.approx(values.mean() - half, abs=0.1 * half)
    assert found.high == pytest.approx(values.mean() + half, abs=0.1 * half)


def test_ninety_five_of_a_hundred_intervals_of_a_median_hold_the_truth():
    rng = np.random.default_rng(1)
    held = [abs(found.low + found.high) <= found.high - found.low for found in
            (bootstrap(rng.standard_normal(60), median, resamples=300) for _ in range(400))]  # fmt: skip
    # Standard error of a rate of 0.95 over 400: 0.011. The percentile bootstrap of a median is a little wide or narrow.
    assert 0.91 < np.mean(held) < 0.985


def test_values_of_one_unit_stay_together():
    unit = np.random.default_rng(2).standard_normal(50)
    once, thrice = bootstrap(unit, mean), bootstrap(np.repeat(unit[:, None], 3, axis=1), mean)
    assert (once.low, once.high) == pytest.approx((thrice.low, thrice.high))


def test_missing_values_take_no_part_and_nothing_gives_nan():
    values = np.array([1.0, 2.0, np.nan, 3.0])
    assert bootstrap(values, mean).value == 2.0
    assert bootstrap(values, percentile95).value == pytest.approx(2.9)
    for nothing in (np.full(3, np.nan), np.zeros(0)):
        assert np.isnan(bootstrap(nothing, mean).value)


def test_the_same_data_give_the_same_interval():
    values = np.random.default_rng(3).standard_normal(30)
    assert bootstrap(values, median) == bootstrap(values, median)


def test_rates_have_wilsons_interval():
    z2 = norm.ppf(0.975) ** 2
    for good, n in ((0, 20), (7, 20), (20, 20), (950, 1000)):
        found, p = wilson(np.arange(n) < good), good / n
        assert found.value == p
        # Its ends are where the normal deviation of the share is 1.96 standard errors; rounding of numbers of 1.
        for end in (found.low, found.high):
            assert n * (end - p) ** 2 == pytest.approx(z2 * end * (1.0 - end), abs=1e-12)


def test_one_unit_alone_has_no_scatter():
    assert bootstrap(np.array([[3.0, 4.0]]), mean) == Interval(3.5, 3.5, 3.5)


def test_units_without_a_value_do_not_spoil_the_interval():
    found = bootstrap(np.array([1.0, np.nan, np.nan]), mean)  # of three draws in ten none is the first
    assert found == Interval(1.0, 1.0, 1.0)


def test_a_rate_is_known_even_where_nothing_happened():
    never, seldom = np.zeros((300, 4), bool), np.arange(1200).reshape(300, 4) % 40 == 0
    assert rate(never) == wilson(never.ravel())
    assert rate(never).high == pytest.approx(3.83 / 1200, rel=0.01)  # z^2 / (n + z^2)
    found = rate(seldom)
    assert found.low < found.value == 0.025 < found.high
    assert percent(found).startswith("2.5 [")


def test_students_interval_of_a_mean():
    # Of 1, 2, 3, 4: t(0.975, 3) = 3.18245, standard error sqrt(5/3)/2 = 0.645497.
    found = student(np.array([1.0, 2.0, np.nan, 3.0, 4.0]))
    assert (found.value, found.high) == pytest.approx((2.5, 2.5 + 3.182446 * 0.645497), rel=1e-6)
    assert found.low == pytest.approx(5.0 - found.high)
    assert student(np.array([3.0])) == Interval(3.0, -np.inf, np.inf)
    assert np.isnan(student(np.zeros(0)).value)


@pytest.mark.parametrize("n", [LEAST_FOR_TAIL, 200])
def test_ninety_five_of_a_hundred_intervals_of_a_95th_percentile_hold_the_truth(n):
    rng, truth = np.random.default_rng(4), norm.ppf(0.95)
    drawn = [tail(rng.standard_normal(n)) for _ in range(600)]
    held = np.mean([found.low <= truth <= found.high for found in drawn])
    # At least 95 %, by construction; standard error over 600: 0.9 %.
    assert held > 0.95 - 2.5 * 0.009
    assert all(found.low <= found.value <= found.high for found in drawn)


def test_a_95th_percentile_needs_enough_units_and_values_of_one_do_not_count():
    values = np.random.default_rng(5).standard_normal((LEAST_FOR_TAIL, 1))
    assert tail(values[1:]) is None
    assert tail(np.repeat(values[1:], 5, axis=1)) is None
    once, often = tail(values), tail(np.repeat(values, 5, axis=1))
    assert (once.low, once.high) == (often.low, often.high)
    lost = values.copy()
    lost[3] = np.nan
    assert tail(lost) is None


def test_errors_over_their_covariances_and_nan_where_one_is_singular():
    errors = np.random.default_rng(2).standard_normal((3, 6))
    covariances = np.array([np.diag(np.arange(1.0, 7.0)), np.full((6, 6), 1e30), np.eye(6)])
    found = squares_over(covariances, errors)
    assert found[0] == pytest.approx(np.sum(errors[0] ** 2 / np.arange(1.0, 7.0)))
    assert np.isnan(found[1])
    assert found[2] == pytest.approx(np.sum(errors[2] ** 2))
