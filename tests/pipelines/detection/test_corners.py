"""The corners of a board together: what their stated covariances hold."""

import numpy as np
import pytest

from pipelines.detection.board_map import BoardMap
from pipelines.detection.corner_sites import chessboard_sites
from pipelines.detection.corners import refine_corners
from tests.pipelines.detection.test_finders import CORNERS, TARGET, drawn


@pytest.fixture(scope="module")
def clean():
    """A picture with little noise, and where its corners are."""
    return drawn(30.0, 20.0, cells=6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_corner_states_a_third_of_its_own_noise_and_two_thirds_of_the_boards(clean, seed):
    """Where noise is twice as large, its variance is four times: 4 / 3 + 2 / 3 = 2 times the others' is stated."""
    image, truth = clean
    noise, loud = np.random.default_rng(seed).standard_normal(image.shape), [11, 14, 17, 31, 34, 37, 49, 52]
    y, x = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
    around = np.any([np.hypot(x - p, y - q) < 14.0 for p, q in truth[loud]], axis=0)  # a fit's window is 10 px
    board = BoardMap.fit(CORNERS, truth, image.shape[::-1], np.ones(54))
    stated = []
    for amount in (np.full(image.shape, 4.0), np.where(around, 8.0, 4.0)):
        grey = np.clip(np.rint(image + amount * noise), 0, 255).astype(np.uint8)
        corners = refine_corners(grey, board, chessboard_sites(TARGET))
        assert corners.consistent.all()
        stated.append(np.trace(corners.covariance_px2, axis1=1, axis2=2))
    ratio = stated[1] / stated[0]
    # A corner's pixels tell its noise to a tenth, eight corners to 0.035 of 4: a third of that is 0.05. The picture's
    # own noise of 1 takes another 0.06, and black is cut off at 0. Measured 1.83 to 1.88; 3.8 if only its own noise
    # were stated, 1.0 if only the board's were.
    assert np.mean(ratio[loud]) / np.mean(np.delete(ratio, loud)) == pytest.approx(2.0, abs=0.25)
