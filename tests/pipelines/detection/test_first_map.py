"""The first map is led by most of a finder's corners, not by those that are off or beside the circle."""

import numpy as np

from pipelines.detection import detect_points
from pipelines.detection.board_map import BoardMap
from pipelines.detection.finders import find_board
from pipelines.detection.first_map import first_map
from pipelines.detection.seen_points import SeenPoints
from tests.pipelines.detection.test_board_map import CAMERAS, CORNERS, SIZE, placed, rms
from tests.pipelines.detection.test_finders import TARGET, drawn

BESIDE_CIRCLE = [0, 9]  # the two right corners of the circle's square; the next ones are 1.6 squares from its centre


def test_rough_corners_beside_the_circle_take_no_part_in_the_first_map(monkeypatch):
    """A finder may take the circle's rim for the square's edge: where it then puts these two changes no bit."""
    image, _ = drawn(30.0, 20.0, cells=6)
    found = find_board(image, TARGET)

    def detected(shift_px):
        corners = found.points_px.copy()
        corners[BESIDE_CIRCLE] += shift_px
        rough = SeenPoints(found.ids, corners, found.finder)
        monkeypatch.setattr("pipelines.detection.boards.find_board", lambda *given: rough)
        return detect_points(image, TARGET)

    expected, shifted = detected(0.0), detected([3.0, -2.0])
    assert set(expected.status[:-1]) == {"ok"}
    np.testing.assert_array_equal(shifted.points_px, expected.points_px)
    np.testing.assert_array_equal(shifted.covariance_px2, expected.covariance_px2)


def test_a_rough_fit_is_not_pulled_by_corners_that_are_off():
    """A classic finder puts some corners a few pixels off; the map must lead the fit to the others."""
    rng = np.random.default_rng(3)
    pixels = CAMERAS["equidistance"](placed("near", CORNERS)) + 0.3 * rng.standard_normal((54, 2))
    pixels[[4, 17, 40]] += [[6.0, -3.0], [-5.0, 5.0], [0.0, 8.0]]
    rough = first_map(SeenPoints(np.arange(54), pixels, "rough"), SIZE, TARGET)
    plain = BoardMap.fit(CORNERS, pixels, SIZE, np.ones(54))
    # Noise of 0.3 px leaves 0.3 sqrt(13 / 108) = 0.10 px; measured 0.10 to 0.16 over six draws, and 0.34 to 0.41 for
    # the plain fit.
    assert rms(rough, "equidistance", "near") < 0.22
    assert rms(plain, "equidistance", "near") > 0.28
