"""One metric of two systems: intervals that hold, verdicts that mean what they say."""

import numpy as np
import pytest
from scipy import stats

from pipelines.nightly.comparison import Verdict, compare_paired, compare_unpaired, holm, verdicts
from pipelines.nightly.metrics import METRICS

X, LOG, NEES = METRICS["corner_x"], METRICS["corner_log_ms"], METRICS["corner_nees"]


def _paired(metric, old, new):
    """The only change of one metric."""
    (change,) = compare_paired([metric], old[None], new[None])
    return change


def test_a_paired_change_is_the_paired_t_test():
    rng = np.random.default_rng(0)
    old, new = rng.normal(size=20), rng.normal(0.3, 1.0, 20)
    change = _paired(X, old, new)
    expected = stats.ttest_rel(new, old)
    assert change.p == pytest.approx(expected.pvalue, rel=1e-12)
    assert change.interval == pytest.approx(tuple(expected.confidence_interval(0.95)), rel=1e-12)


def test_an_unpaired_change_is_welchs_test():
    rng = np.random.default_rng(1)
    old, new = rng.normal(size=20), rng.normal(0.3, 2.0, 35)
    change = compare_unpaired(X, old, new)
    assert change.p == pytest.approx(stats.ttest_ind(new, old, equal_var=False).pvalue, rel=1e-12)


def test_holm_is_the_known_example():
    """Holm 1979's procedure by hand: .005 <= .05/4, .01 <= .05/3, .03 > .05/2, so two are rejected and .04 is not."""
    assert holm(np.array([0.01, 0.04, 0.03, 0.005]), 0.05).tolist() == [True, False, False, True]
    assert holm(np.array([0.001, 0.002]), 0.05).tolist() == [True, True]


@pytest.mark.parametrize(
    ("metric", "old", "new", "verdict"),
    [
        (X, 0.0, 0.002, Verdict.WORSE),
        (X, 0.002, 0.0, Verdict.BETTER),
        (X, 0.0, -0.002, Verdict.WORSE),
        (X, -0.0015, 0.0016, Verdict.WORSE),  # through zero to the other side, and a little further out
        (X, 0.0, 0.0001, Verdict.EQUAL),  # seen for certain, and too small to matter
        (LOG, -10.0, -9.8, Verdict.WORSE),
        (LOG, -10.0, -10.2, Verdict.BETTER),
        (NEES, 1.0, 1.3, Verdict.WORSE),
        (NEES, 1.0, 0.7, Verdict.WORSE),  # stated errors that are too large are wrong, too
        (NEES, 0.7, 1.0, Verdict.BETTER),
    ],
)
def test_the_direction_of_worse(metric, old, new, verdict):
    scatter = np.random.default_rng(2).normal(size=40) * 1e-3 * metric.margin
    change = _paired(metric, old + scatter, new + 0.5 * scatter)
    assert verdicts([change], 0.01) == [verdict]


def test_scatter_that_hides_a_change_is_unproved_and_not_equal():
    rng = np.random.default_rng(3)
    old, new = (rng.normal(0.0, 20.0 * X.margin, 20) for _ in range(2))
    assert verdicts([_paired(X, old, new)], 0.01) == [Verdict.UNPROVED]


def test_too_few_poses_have_no_verdict():
    few = np.array([0.0, 1.0, np.nan, 2.0, 3.0, np.nan])
    assert compare_paired([X], few[None], few[None]) == []
    assert compare_unpaired(X, few, few) is None


@pytest.mark.parametrize("metric", [X, LOG, NEES])
def test_the_interval_holds_the_change_as_often_as_it_says(metric):
    """2000 draws of 20 poses: 95 % within 3 standard errors of a rate, 1.5 %; a log of a mean only nearly."""
    rng, held, draws = np.random.default_rng(4), 0, 2000
    for _ in range(draws):
        both = rng.chisquare(30, (2, 20)) / 30 if metric is NEES else rng.normal(size=(2, 20))
        low, high = _paired(metric, *both).interval
        held += low <= 0.0 <= high
    assert abs(held / draws - 0.95) < 0.015


def test_the_smallest_visible_change_is_seen_in_95_of_100():
    """1000 nights: 95 % plus or minus 3 standard errors, 2.1 %, and a normal quantile beside a t one, 1 %."""
    rng, alpha, tests = np.random.default_rng(5), 0.01, 10
    visible = _paired(X, *rng.normal(size=(2, 400))).smallest_visible(alpha, tests)
    seen = 0
    for _ in range(1000):
        old, new = rng.normal(size=(2, 400))
        seen += _paired(X, old, new + visible).p <= alpha / tests
    assert abs(seen / 1000 - 0.95) < 0.031
