"""The printed patterns against the programs that read them and the rules that they are drawn by."""

import cv2
import numpy as np
import pytest

from render.targets.aprilgrid import AprilGrid
from render.targets.charuco import Charuco
from render.targets.circle_grid import CircleGrid
from render.targets.markers import DICTIONARIES, TAG_FAMILY, marker_bits, marker_count
from render.targets.plain_chessboard import PlainChessboard
from tests.render.targets.drawn import drawn, to_pixels
from tools.marker_bits import opencv_bits


def test_marker_bits_are_those_of_the_installed_opencv():
    for dictionary in (*DICTIONARIES, TAG_FAMILY):
        theirs = opencv_bits(dictionary)
        assert len(theirs) == marker_count(dictionary)
        np.testing.assert_array_equal([marker_bits(dictionary, i) for i in range(len(theirs))], theirs)


@pytest.mark.parametrize(("columns", "rows"), [(10, 7), (5, 4), (6, 6)])
def test_charuco_is_what_opencv_draws(columns, rows):
    """At 8 px for a module of 8 mm, so that OpenCV's whole pixels are ours."""
    target = Charuco(columns=columns, rows=rows, square_mm=64.0, marker_mm=48.0, dictionary="4X4_100", margin_mm=0.0)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
    board = cv2.aruco.CharucoBoard((columns, rows), 64.0, 48.0, dictionary)
    np.testing.assert_array_equal(drawn(target), board.generateImage((64 * columns, 64 * rows), marginSize=0))
    # OpenCV's origin is the outer corner of the first square.
    np.testing.assert_allclose(np.array(board.getChessboardCorners()) - [64.0, 64.0, 0.0], target.points, atol=1e-4)


def test_aprilgrid_is_read_by_opencv_with_two_border_modules():
    target = AprilGrid(columns=4, rows=3)
    parameters = cv2.aruco.DetectorParameters()
    parameters.markerBorderBits = 2
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(drawn(target))
    assert sorted(ids.ravel()) == list(range(12))
    for tag, found in zip(ids.ravel(), corners, strict=True):
        # OpenCV's picture of a tag stands on its head on Kalibr's board: its upper left corner is the lower right one.
        points = [target.corner_index(int(tag), corner) for corner in (2, 3, 0, 1)]
        expected = to_pixels(target, target.pattern_points[points])
        assert np.abs(found[0] - expected).max() < 3.0  # whole pixels of a contour; another corner is 88 px away


def test_aprilgrid_points_are_numbered_as_kalibr_does():
    """For 2 x 2 tags: 0 1 2 3 along the lower sides of tags 0 and 1, 4 5 6 7 along their upper sides, and so on."""
    target = AprilGrid(columns=2, rows=2, tag_mm=100.0, spacing=0.3)
    points = target.pattern_points
    assert len(points) == 16
    np.testing.assert_allclose(points[[0, 1, 2, 3]], [[0, 0], [100, 0], [130, 0], [230, 0]])
    np.testing.assert_allclose(points[[4, 7]], [[0, -100], [230, -100]])
    np.testing.assert_allclose(points[[8, 15]], [[0, -130], [230, -230]])
    assert [target.corner_index(3, corner) for corner in range(4)] == [14, 15, 11, 10]


def test_aprilgrid_has_black_squares_that_touch_every_corner_of_every_tag():
    target = AprilGrid(columns=2, rows=3, tag_mm=100.0, spacing=0.3)
    picture = drawn(target)
    for x, y in to_pixels(target, target.pattern_points):
        rows, columns = ([int(np.floor(at)) - 3, int(np.ceil(at)) + 3] for at in (y, x))
        (first, second), (third, fourth) = picture[np.ix_(rows, columns)]
        assert first == fourth != second == third


def test_circle_grids_are_read_by_opencv():
    plain = CircleGrid(columns=6, rows=4, asymmetric=False)
    shifted = CircleGrid(columns=4, rows=7)
    for target, flag in ((plain, cv2.CALIB_CB_SYMMETRIC_GRID), (shifted, cv2.CALIB_CB_ASYMMETRIC_GRID)):
        seen, centres = cv2.findCirclesGrid(drawn(target), (target.columns, target.rows), flags=flag)
        assert seen
        expected = to_pixels(target, target.pattern_points)
        centres = centres.reshape(-1, 2)
        nearest = np.linalg.norm(centres[:, None] - expected[None], axis=2).argmin(axis=1)
        order = np.arange(len(expected))
        assert np.array_equal(nearest, order) or np.array_equal(nearest, order[::-1])
        assert np.abs(centres - expected[nearest]).max() < 0.2
    i, j = np.mgrid[0:7, 0:4]
    np.testing.assert_allclose(shifted.pattern_points, 60.0 * np.stack(((2 * j + i % 2).ravel(), i.ravel()), axis=1))


@pytest.mark.parametrize(
    "target",
    [
        PlainChessboard(columns=10, rows=7),
        PlainChessboard(columns=4, rows=4),
        CircleGrid(rows=11),
        CircleGrid(rows=10),
        CircleGrid(asymmetric=False),
    ],
)
def test_a_pattern_knows_whether_half_a_turn_changes_it(target):
    picture = drawn(target, 0.5)
    assert target.tells_orientation == (not np.array_equal(picture, picture[::-1, ::-1]))


def test_three_by_three_inner_corners_without_a_margin():
    target = PlainChessboard(columns=4, rows=4, margin_mm=0.0)
    assert len(target.points) == 9
    assert target.sheet.extent_mm == (-100.0, 300.0, -100.0, 300.0)


@pytest.mark.parametrize(
    ("kind", "values", "match"),
    [
        (Charuco, {"dictionary": "4x4_50"}, "dictionary is '4x4_50'; choose one of 4X4_50"),
        (Charuco, {"columns": 11, "rows": 10}, "55 markers and dictionary 4X4_50 only 50"),
        (Charuco, {"marker_mm": 95.0}, "30 to 90 mm"),
        (Charuco, {"columns": 2}, "2 x 7 squares; each number must lie in 3 to 60"),
        (AprilGrid, {"spacing": 0.0}, "spacing is 0.0; it must lie in 0.05 to 1"),
        (AprilGrid, {"tag_mm": -1.0}, "tag_mm is -1.0; it must be above 0 mm"),
        (CircleGrid, {"diameter_mm": 58.0}, "6 to 54 mm"),
        (PlainChessboard, {"margin_mm": -1.0}, "margin_mm is -1.0"),
        (PlainChessboard, {"white": 0.1, "black": 0.5}, "white must reflect more than black"),
        (PlainChessboard, {"bend_sag_mm": 500.0}, "bend_sag_mm is 500.0"),
    ],
)
def test_impossible_boards_are_refused(kind, values, match):
    with pytest.raises(ValueError, match=match):
        kind(**values)
