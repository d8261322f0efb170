"""What is left out around the raised circle: every place at which it may be."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pipelines.detection.board_map import BoardMap
from pipelines.detection.circle_surroundings import ellipses_around_circle
from render.targets.chessboard import Chessboard


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
    centres, to_unit_circle = ellipses_around_circle(board, target, 0.8)
    displaced = board(foot, height) - board(foot)
    assert np.linalg.norm(displaced) > 0.5  # px: else the places could not be told apart
    np.testing.assert_allclose(centres, board(foot) + np.array(ways)[:, None] * displaced, atol=1e-9)
    # The whole disc lies inside the ellipse, and 2 px beside its rim too.
    angles = np.linspace(0.0, 2.0 * np.pi, 60)
    rim = board(foot + 0.3 * np.stack((np.cos(angles), np.sin(angles)), axis=1)) - board(foot)
    beside = rim * (1.0 + 2.0 / np.linalg.norm(rim, axis=1, keepdims=True))
    assert np.linalg.norm(beside @ to_unit_circle.T, axis=1).max() < 1.0
