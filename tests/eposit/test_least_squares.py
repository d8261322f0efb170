"""Damped Gauss-Newton for many problems, against SciPy's least squares one problem at a time."""

import numpy as np
import pytest
from scipy.optimize import least_squares

from eposit.least_squares import damped_gauss_newton

TIMES = np.linspace(0.0, 2.0, 9)


def decays(seen):
    """Residuals of a exp(-b t) against (9, m) readings, for unknowns (a, b)."""

    def model(x, rows):
        falling = np.exp(-x[1] * TIMES[:, None])
        return x[0] * falling - seen[:, rows], np.stack((falling, -x[0] * TIMES[:, None] * falling), axis=1)

    return model


def noisy_decays(rng, m):
    x = np.stack((rng.uniform(1.0, 5.0, m), rng.uniform(0.3, 2.0, m)))
    return x, x[0] * np.exp(-x[1] * TIMES[:, None]) + rng.normal(0.0, 0.05, (len(TIMES), m))


def rosenbrock(x, rows):
    """Two residuals along a bent valley, least at (1, 1); from afar plain Gauss-Newton steps raise the sum."""
    zero = np.zeros(len(rows))
    miss = np.stack((10.0 * (x[1] - x[0] ** 2), 1.0 - x[0]))
    slopes = np.stack((np.stack((-20.0 * x[0], zero + 10.0)), np.stack((zero - 1.0, zero))))
    return miss, slopes


def test_minima_are_those_of_scipy():
    truth, seen = noisy_decays(np.random.default_rng(1), 40)
    found = damped_gauss_newton(decays(seen), truth * 1.3, 50)
    assert np.all(found.converged)
    for i in range(40):
        one = least_squares(
            lambda x, i=i: x[0] * np.exp(-x[1] * TIMES) - seen[:, i], truth[:, i], xtol=1e-15, ftol=1e-15, gtol=1e-15
        )
        # SciPy's slopes are differences: they set its gradient to zero to about 1e-8.
        np.testing.assert_allclose(found.x[:, i], one.x, rtol=1e-6)


def test_a_step_that_raises_the_sum_is_not_taken():
    starts = np.array([[-1.2, 5.0, -30.0], [1.0, -7.0, 2.0]])
    rows, before = np.arange(3), np.full(3, np.inf)
    for limit in range(150):
        x = damped_gauss_newton(rosenbrock, starts, limit).x
        total = np.sum(rosenbrock(x, rows)[0] ** 2, axis=0)
        assert np.all(total <= before * (1.0 + 1e-11))
        before = total
    np.testing.assert_allclose(x, 1.0, rtol=1e-9)


def test_each_problem_stops_for_itself():
    """A problem alone takes the same steps as among others, which leave one by one."""
    truth, seen = noisy_decays(np.random.default_rng(2), 12)
    starts = truth * np.linspace(1.0, 1.6, 12)
    starts[:, 3] = np.nan
    worked_on = []

    def counted(x, rows):
        worked_on.append(len(rows))
        return decays(seen)(x, rows)

    together = damped_gauss_newton(counted, starts, 60)
    assert worked_on[0] == 12
    assert worked_on[-1] <= 6  # at most twice those that still move
    assert len(set(together.steps)) > 3
    for i in range(12):
        alone = damped_gauss_newton(decays(seen[:, i : i + 1]), starts[:, i : i + 1], 60)
        np.testing.assert_array_equal(alone.x[:, 0], together.x[:, i])
        assert alone.steps[0] == together.steps[i]
        assert alone.converged[0] == together.converged[i]
    assert not together.converged[3]
    assert together.steps[3] == 0
    assert np.all(np.isnan(together.x[:, 3]))


@pytest.mark.parametrize("limit", [0, 1, 3])
def test_the_limit_ends_the_search(limit):
    truth, seen = noisy_decays(np.random.default_rng(3), 5)
    starts = truth * 1.5
    found = damped_gauss_newton(decays(seen), starts, limit)
    assert not np.any(found.converged)
    assert np.all(found.steps == limit)
    if limit == 0:
        np.testing.assert_array_equal(found.x, starts)


def test_a_problem_without_a_step_stays_and_has_not_converged():
    """An unknown that no residual depends on leaves the normal equations singular."""

    def model(x, rows):
        zero = np.zeros(len(rows))
        flat = np.where(rows == 1, 0.0, 1.0)
        return np.stack((x[0] - 2.0, flat * (x[1] - 3.0), zero)), np.stack(
            (np.stack((zero + 1.0, zero)), np.stack((zero, flat)), np.stack((zero, zero)))
        )

    found = damped_gauss_newton(model, np.ones((2, 3)), 30)
    np.testing.assert_allclose(found.x[:, [0, 2]], [[2.0, 2.0], [3.0, 3.0]], rtol=1e-12)
    np.testing.assert_array_equal(found.x[:, 1], 1.0)
    assert list(found.converged) == [True, False, True]
    assert found.steps[1] == 1  # there is no other step to try
    assert found.take(np.array([1])).converged.tolist() == [False]


def test_no_problems():
    found = damped_gauss_newton(decays(np.zeros((9, 0))), np.zeros((2, 0)), 5)
    assert found.x.shape == (2, 0)
    assert len(found.steps) == len(found.converged) == 0
