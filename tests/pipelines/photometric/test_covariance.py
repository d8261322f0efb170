"""The larger of two covariances, direction by direction."""

import numpy as np

from pipelines.photometric.covariance import at_least


def test_it_is_as_large_as_either_in_every_direction():
    rng = np.random.default_rng(3)
    one, other = (part @ part.T for part in rng.standard_normal((2, 7, 9)))
    both = at_least(one, other)
    for part in (one, other):
        assert np.linalg.eigvalsh(both - part).min() > -1e-9


def test_a_smaller_one_changes_nothing():
    one = np.diag([1.0, 4.0, 9.0])
    assert np.allclose(at_least(one, 0.5 * one), one)
    assert np.allclose(at_least(one, np.diag([2.0, 1.0, 9.0])), np.diag([2.0, 4.0, 9.0]))
