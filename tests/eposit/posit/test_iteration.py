"""The iteration as a whole: what Newton's steps leave over goes the plain way."""

import numpy as np

from eposit.posit.iteration import posit
from eposit.posit.newton import CONTRACTS, fixed_points
from eposit.posit.orthography import Orthography
from tests.eposit.posit.test_orthography import systems


def test_a_batch_that_contracts_throughout_has_its_unsettled_rows_iterated_on():
    system = Orthography.of(*systems(4, 300, 5.0))
    system = system.take(np.flatnonzero(system.contraction <= CONTRACTS))
    _, settled, _ = fixed_points(system, 1e-12)
    assert 0 < np.sum(~settled) < len(settled)
    assert np.all(posit(system, 1e-12, 2000).converged)
