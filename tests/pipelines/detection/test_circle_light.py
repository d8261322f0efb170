"""A circle whose shadow is not where the fit begins is found in its place."""

import numpy as np
import pytest

from pipelines.detection import detect_points
from tests.stress.answers import target_of
from tests.stress.kinds import KINDS


# Without a second start, 0.09 px off with 0.004 stated in the first, and its residuals are a hundred times too large in
# the second, which was taken for a room's light then.
@pytest.mark.parametrize(("kind", "view"), [("plain-noise", 0), ("disc-shadow", 3)])
def test_a_shadow_in_an_unusual_place_is_found(kind, view):
    shot = KINDS[kind].shot(view)
    found = detect_points(shot.image, target_of(KINDS[kind].target))
    assert found.status[-1] == "ok"
    error = found.points_px[-1] - shot.truth[-1]
    assert error @ np.linalg.solve(found.covariance_px2[-1], error) < 13.8  # 0.999 of two squares of unit variance
