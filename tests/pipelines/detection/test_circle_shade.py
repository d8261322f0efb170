"""The light that the raised circle keeps from the board is given back to the pixels from which corners are fitted."""

import numpy as np
import pytest

from pipelines.detection.circle_shade import without_shade
from render.targets.chessboard import Chessboard
from render.targets.disc_shade import blocked_share
from tests.pipelines.detection.test_circle_surroundings import camera_above

TARGET = Chessboard()
FOOT = TARGET.circle_centre[:2] / TARGET.square_mm
SIZE = (600, 800)
BLUR_PX = 0.8


def seen_places(board):
    """(2, h, w) squares from the circle's foot, pixel by pixel."""
    x, y = np.arange(float(SIZE[1])), np.arange(float(SIZE[0]))
    return board.meet_planes(x, y, np.zeros(1))[0] - FOOT[:, None, None]


def shaded(board, share):
    """White of 200 grey levels with a slope, black beyond the circle's square, and what the circle hides of it."""
    places = seen_places(board)
    light = 200.0 + 5.0 * places[0] - 3.0 * places[1]
    light = np.where(np.abs(places).max(axis=0) < 0.5, light, 0.1 * light)
    hidden = blocked_share(np.hypot(*places), 0.3, 0.1)
    noise = 0.3 * np.random.default_rng(3).normal(size=SIZE)  # as much as rounding to whole grey levels makes
    return light, (light * (1.0 - share * hidden) + noise).astype(np.float32)


@pytest.mark.parametrize("tilt_deg", [0.0, 40.0])
@pytest.mark.parametrize("share", [0.0, 0.3, 0.8])
def test_the_board_is_as_bright_as_without_the_circle(share, tilt_deg):
    board = camera_above(tilt_deg, TARGET)
    light, picture = shaded(board, share)
    found = without_shade(picture, board, TARGET, BLUR_PX)
    from_foot = np.hypot(*seen_places(board))
    beside = (from_foot > 0.4) & (from_foot < 0.9)
    ratio = found[beside] / light[beside]
    # Up to 0.08 of the light are missing there. The share is found to 0.01 from pixels with this noise, and its hidden
    # part is at most 0.1 of it: 0.001. Means over many pixels leave nothing of the noise.
    for near, far in ((0.4, 0.5), (0.5, 0.7), (0.7, 0.9)):
        ring = (from_foot[beside] > near) & (from_foot[beside] < far)
        assert abs(ratio[ring].mean() - 1.0) < 0.0015
    np.testing.assert_array_equal(found[from_foot < 0.29], picture[from_foot < 0.29])
    np.testing.assert_array_equal(found[:50], picture[:50])


def test_a_share_that_noise_hides_is_the_usual_one():
    board = camera_above(20.0, TARGET)
    light, picture = shaded(board, 0.3)
    noise = 60.0 * np.random.default_rng(4).normal(size=SIZE)
    found = without_shade((picture + noise).astype(np.float32), board, TARGET, BLUR_PX) - noise
    ring = np.abs(np.hypot(*seen_places(board)) - 0.45) < 0.05
    # Without what is known beforehand the share would be anything from 0 to 1: 0.03 of the light.
    assert abs(np.mean(found[ring] / light[ring]) - 1.0) < 0.02


def test_a_circle_out_of_view_changes_nothing():
    board = camera_above(0.0, TARGET)
    picture = np.full((100, 100), 200.0, np.float32)  # the circle's image lies at (400, 300)
    assert without_shade(picture, board, TARGET, BLUR_PX) is picture
