"""A circle whose shadow is not where the fit begins is found in its place."""

import numpy as np

from pipelines.detection import detect_points
from tests.stress.answers import target_of
from tests.stress.kinds import KINDS


def test_a_shadow_in_an_unusual_place_is_found():
    """From one start alone the place is 0.09 px off with 0.004 stated."""
    kind = KINDS["plain-noise"]
    shot = kind.shot(0)
    found = detect_points(shot.image, target_of(kind.target))
    assert found.status[-1] == "ok"
    error, covariance = found.points_px[-1] - shot.truth[-1], found.covariance_px2[-1]
    assert error @ np.linalg.solve(covariance, error) < 13.8  # 0.999 of two squares of unit variance
    assert np.sqrt(np.diag(covariance)).max() < 0.03  # measured 0.017, with what the rim's form is worth
