"""The corners of a board together: what the circle beside them may spoil, and what their stated covariances hold."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipelines.detection import detect_points
from pipelines.detection.board_map import BoardMap
from pipelines.detection.corners import _around_circle, refine_corners
from pipelines.detection.finders import Found, find_board
from render.targets.chessboard import Chessboard
from tests.pipelines.detection.test_finders import CORNERS, TARGET, drawn

BESIDE_CIRCLE = [0, 9]  # the two right corners of the circle's square; the next ones are 1.6 squares from its centre


@pytest.fixture(scope="module")
def clean():
    """A picture with little noise, and where its corners are."""
    return drawn(30.0, 20.0, cells=6)


def test_rough_corners_beside_the_circle_take_no_part_in_the_first_map(clean, monkeypatch):
    """A finder may take the circle's rim for the square's edge: where it then puts these two changes no bit."""
    image, _ = clean
    found = find_board(image, TARGET)

    def detected(shift_px):
        corners = found.corners_px.copy()
        corners[BESIDE_CIRCLE] += shift_px
        monkeypatch.setattr("pipelines.detection.find_board", lambda image, target: Found(corners, found.finder))
        return detect_points(image, TARGET)

    expected, shifted = detected(0.0), detected([3.0, -2.0])
    assert set(expected.status[:-1]) == {"ok"}
    np.testing.assert_array_equal(shifted.points_px, expected.points_px)
    np.testing.assert_array_equal(shifted.covariance_px2, expected.covariance_px2)


def camera_above(tilt_deg, target):
    """A map that looks along its axis at the circle's foot, tilted by an angle."""
    foot = np.append(target.circle_centre[:2] / target.square_mm, 0.0)
    R = Rotation.from_euler("x", tilt_deg, degrees=True).as_matrix()
    lens = np.array([500.0, 0.0, 400.0, 300.0, 0.0, 0.0, 0.0])
    return BoardMap(R, np.array([0.0, 0.0, 15.0]) - R @ foot, lens)


# Height of the circle, mm; tilt, degrees; places to leave out, in displacements that the height makes. It displaces the
# circle by the height times the tilt's tangent.
PLACES = {
    "either way, where a small tilt does not tell which": (10.0, 20.0, [0.0, 1.0, -1.0]),
    "as the map says, where it is sure": (25.0, 55.0, [0.0, 1.0]),
    "the foot alone, where the map is not to be believed": (10.0, 75.0, [0.0]),
}


@pytest.mark.parametrize(("height_mm", "tilt_deg", "ways"), PLACES.values(), ids=PLACES)
def test_what_is_left_out_around_a_raised_circle(height_mm, tilt_deg, ways):
    target = Chessboard(circle_height_mm=height_mm)
    board = camera_above(tilt_deg, target)
    foot, height = target.circle_centre[:2] / target.square_mm, height_mm / target.square_mm
    centres, to_unit_circle = _around_circle(board, target)
    displaced = board(foot, height) - board(foot)
    assert np.linalg.norm(displaced) > 0.5  # px: else the places could not be told apart
    np.testing.assert_allclose(centres, board(foot) + np.array(ways)[:, None] * displaced, atol=1e-9)
    # The whole disc lies inside the ellipse, and 2 px beside its rim too.
    angles = np.linspace(0.0, 2.0 * np.pi, 60)
    rim = board(foot + 0.3 * np.stack((np.cos(angles), np.sin(angles)), axis=1)) - board(foot)
    beside = rim * (1.0 + 2.0 / np.linalg.norm(rim, axis=1, keepdims=True))
    assert np.linalg.norm(beside @ to_unit_circle.T, axis=1).max() < 1.0


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
        corners = refine_corners(grey, board, TARGET)
        assert corners.consistent.all()
        stated.append(np.trace(corners.covariance_px2, axis1=1, axis2=2))
    ratio = stated[1] / stated[0]
    # A corner's pixels tell its noise to a tenth, eight corners to 0.035 of 4: a third of that is 0.05. The picture's
    # own noise of 1 takes another 0.06, and black is cut off at 0. Measured 1.83 to 1.88; 3.8 if only its own noise
    # were stated, 1.0 if only the board's were.
    assert np.mean(ratio[loud]) / np.mean(np.delete(ratio, loud)) == pytest.approx(2.0, abs=0.25)
