"""Pictures after the point spread, and how they change with place and width."""

import numpy as np

from pipelines.photometric.point_spread import PointSpread

SIGMA_PX = 0.9
STEP_PX = 0.05
PLACES = np.arange(0.0, 1.0, STEP_PX)  # of an edge in its pixel


def edge(shift):
    """(21, 41) a step at column 19.5 + shift, averaged over pixels."""
    return np.clip(np.arange(41.0) - 19.0 - shift, 0.0, 1.0)[None].repeat(21, axis=0).astype(np.float32)


def test_its_gradient_is_the_numeric_derivative():
    """On the mean over an edge's places in a pixel; within a pixel the derivative of an averaged step jumps."""
    spread = PointSpread.of(SIGMA_PX)
    found = np.mean([spread.gradient(edge(place)) for place in PLACES], axis=0)
    numeric = (spread.blurred(edge(-0.5 * STEP_PX)) - spread.blurred(edge(1.0 - 0.5 * STEP_PX))) / len(PLACES) / STEP_PX
    assert np.allclose(found[0], numeric, atol=1e-3)  # of 0.44; steps of 0.05 px are a fifteenth of the box's moment
    assert np.allclose(found[1], 0.0, atol=1e-6)


def test_its_growth_is_the_numeric_derivative():
    image = edge(0.3)
    wider = PointSpread.of(SIGMA_PX + 0.01).blurred(image) - PointSpread.of(SIGMA_PX - 0.01).blurred(image)
    assert np.allclose(PointSpread.of(SIGMA_PX).widened(image), wider / 0.02, atol=1e-3)


def test_it_keeps_the_light():
    assert np.isclose(PointSpread.of(SIGMA_PX).spread.sum(), 1.0)
    assert np.isclose(PointSpread.of(SIGMA_PX).growth.sum(), 0.0)
