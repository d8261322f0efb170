"""Roots of quartics where the closed form alone loses digits."""

import numpy as np

from eposit.starts.quartic_roots import quartic_roots


def test_roots_of_very_different_size_keep_their_digits():
    """The shift by a quarter of the largest root would leave a root of 1e-4 four digits less than this."""
    rng = np.random.default_rng(31)
    roots = np.sort(np.array([1e-4, 1e-2, 1.0, 1e3])[:, None] * rng.uniform(1.0, 2.0, (4, 500)), axis=0)
    rising = [np.array([np.poly(one)[4 - power] for one in roots.T]) for power in range(5)]
    found = np.sort(quartic_roots(rising), axis=0)
    # Coefficients of full precision state such roots to 1e-13 or so.
    np.testing.assert_allclose(found, roots, rtol=1e-11)
