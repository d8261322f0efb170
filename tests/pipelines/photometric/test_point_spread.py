"""Pictures after the point spread, and how they change with place and width."""

import numpy as np

from pipelines.photometric.point_spread import PointSpread

SIGMA_PX, STEP_PX = 0.9, 0.05


def hill(shift=0.0):
    """(31, 41) a gaussian hill: smooth, so that samples at pixel centres stand for it."""
    x, y = np.arange(41.0) - 20.3 - shift, np.arange(31.0)[:, None] - 14.8
    return np.exp(-(x**2 + 2.0 * y**2) / 18.0).astype(np.float32)


def test_its_gradient_is_the_numeric_derivative():
    spread = PointSpread.of(SIGMA_PX)
    along_x, along_y = spread.gradient(hill())
    numeric = (spread.blurred(hill(-STEP_PX)) - spread.blurred(hill(STEP_PX))) / (2.0 * STEP_PX)
    # Float32 over the step leaves 2e-6, the step's square 1e-4.
    assert np.allclose(along_x, numeric, atol=2e-4)
    across = spread.gradient(np.ascontiguousarray(hill().T))[0].T
    assert np.allclose(along_y, across, atol=1e-6)


def test_its_growth_is_the_numeric_derivative():
    wider = PointSpread.of(SIGMA_PX + 0.01).blurred(hill()) - PointSpread.of(SIGMA_PX - 0.01).blurred(hill())
    assert np.allclose(PointSpread.of(SIGMA_PX).widened(hill()), wider / 0.02, atol=2e-4)


def test_it_keeps_the_light():
    assert np.isclose(PointSpread.of(SIGMA_PX).spread.sum(), 1.0)
    assert np.isclose(PointSpread.of(SIGMA_PX).growth.sum(), 0.0)
