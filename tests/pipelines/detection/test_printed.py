"""Printed boards found in rendered pictures: numbers, places and covariances against the exact projection."""

import numpy as np
import pytest

from eposit import Camera, Pose
from eposit.pose import rotation_from_euler
from pipelines.detection import Detector, detect_points, takes_target
from pipelines.detection.circle_grids import find_circle_grid
from pipelines.detection.printed import corner_sites, place_points
from pipelines.detection.seen_points import SeenPoints
from pipelines.stages.generate import outline_centroid
from render.frame import render_frame
from render.light import Light
from render.sensor.develop import SensorModel, develop
from render.targets.aprilgrid import AprilGrid
from render.targets.charuco import Charuco
from render.targets.circle_grid import CircleGrid
from render.targets.plain_chessboard import PlainChessboard

CAMERA = Camera(lens="equisolid", fx=400.0, fy=400.5, cx=401.3, cy=299.2, width=800, height=600)
FULL = pytest.mark.full
BOARDS = [
    Charuco(columns=6, rows=5, bend_sag_mm=20.0),
    AprilGrid(columns=4, rows=3, tag_mm=120.0, print_scale=(1.01, 0.99)),
    pytest.param(AprilGrid(columns=4, rows=4, tag_mm=120.0, bend_sag_mm=10.0, bend_axis="both"), marks=FULL),
    CircleGrid(columns=3, rows=7, spacing_mm=80.0, diameter_mm=56.0),
    pytest.param(CircleGrid(columns=3, rows=7, bend_sag_mm=-10.0, bend_axis="y"), marks=FULL),
    pytest.param(CircleGrid(columns=7, rows=5, asymmetric=False, spacing_mm=100.0, diameter_mm=60.0), marks=FULL),
    PlainChessboard(columns=8, rows=5, bend_sag_mm=2.0),
    pytest.param(PlainChessboard(bend_sag_mm=20.0), marks=FULL),
    pytest.param(PlainChessboard(bend_sag_mm=20.0, bend_axis="both"), marks=FULL),
    pytest.param(PlainChessboard(columns=6, rows=4, margin_mm=20.0), marks=FULL),
    pytest.param(PlainChessboard(columns=4, rows=4, square_mm=150.0), marks=FULL),
]


def pose(target, roll=12.0):
    R = rotation_from_euler(np.deg2rad([25.0, 15.0, roll]))
    return Pose(R, np.array([20.0, -10.0, 900.0]) - R @ target.board_centre)


def picture(target, where, camera=CAMERA):
    return develop(render_frame(target, Light(), camera, where, samples=64).full(camera), SensorModel())


@pytest.mark.parametrize("target", BOARDS)
def test_points_are_where_the_target_says_and_under_their_own_number(target):
    found = detect_points(picture(target, pose(target)), target)
    error = found.points_px - CAMERA.project(pose(target).apply(target.points))
    assert np.all(found.status == "ok")
    normalised = np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.covariance_px2), error) / 2.0
    # 8 bits without noise: a corner of squares of 35 px is good to 0.004 px, one of a tag's to 0.008.
    assert np.sqrt(np.mean(error**2)) < 0.009
    assert np.all(np.abs(error.mean(axis=0)) < 0.002 + 3.0 * error.std(axis=0) / np.sqrt(len(error)))
    # Nine corners scatter by a third, and no noise is drawn. Measured 0.19 to 2.05, the largest on a bent board of
    # 28 corners, of which one at the border, 0.01 px off, is 22 alone.
    assert 0.15 < normalised.mean() < 2.3


@pytest.mark.parametrize("target", [Charuco(columns=6, rows=5), AprilGrid(columns=4, rows=3, tag_mm=120.0)])
def test_a_board_partly_outside_the_picture_has_the_points_that_are_inside(target):
    where = pose(target)
    left = np.quantile(CAMERA.project(where.apply(target.points))[:, 0], 0.4)
    camera = CAMERA.replace(cx=CAMERA.cx - left)  # the picture begins within the board
    truth = camera.project(where.apply(target.points))
    inside = camera.contains(truth)
    assert 0.3 < inside.mean() < 0.8
    found = detect_points(picture(target, where, camera), target)
    ok = found.status == "ok"
    assert not np.any(ok & ~inside)
    assert np.mean(ok[inside]) > 0.8  # those within 3 px of the border, or on a tag that it cuts, may be missing
    assert set(found.status[~ok]) == {"point_not_found"}
    assert np.sqrt(np.mean((found.points_px - truth)[ok] ** 2)) < 0.02


def test_numbers_survive_half_a_turn_where_the_pattern_tells_it():
    for target in (
        CircleGrid(columns=3, rows=5, spacing_mm=100.0, diameter_mm=60.0),
        PlainChessboard(columns=6, rows=5),
    ):
        where = pose(target, roll=192.0)
        found = detect_points(picture(target, where), target)
        assert np.abs(found.points_px - CAMERA.project(where.apply(target.points))).max() < 0.1


def test_a_symmetric_grid_is_read_as_standing_upright():
    """After half a turn its points come in the other order: nothing in the picture tells."""
    target = CircleGrid(columns=5, rows=4, asymmetric=False, spacing_mm=120.0, diameter_mm=60.0)
    assert not target.tells_orientation
    where = pose(target, roll=192.0)
    seen = find_circle_grid(picture(target, where), target)
    truth = CAMERA.project(where.apply(target.points))
    assert np.abs(seen.points_px - truth[::-1]).max() < 1.0


def test_every_other_disc_of_a_texture_is_no_grid():
    """They lie as those of an asymmetric grid do, but it is not white between them."""
    target, step = CircleGrid(), 24
    discs = target.pattern_points / target.spacing_mm * step + 3.0 * step
    y, x = np.mgrid[0:400, 0:320]
    apart = np.hypot((x + step / 2) % step - step / 2, (y + step / 2) % step - step / 2)
    texture = np.where(apart < 7.0, 30, 200).astype(np.uint8)
    alone = np.full_like(texture, 200)
    for column, row in discs.astype(int):
        inside = slice(row - 9, row + 10), slice(column - 9, column + 10)
        alone[inside] = texture[inside]
    seen = SeenPoints(np.arange(len(discs)), discs, "circles")
    assert np.all(place_points(alone, seen, target).consistent)
    assert not np.any(place_points(texture, seen, target).consistent)


def test_black_squares_are_no_grid_of_discs():
    target = CircleGrid()
    discs = target.pattern_points / target.spacing_mm * 24.0 + 60.0
    squares = np.full((360, 280), 200, np.uint8)
    for column, row in np.rint(discs).astype(int):
        squares[row - 12 : row + 12, column - 12 : column + 12] = 30
    assert find_circle_grid(squares, target) is not None
    assert set(detect_points(squares, target).status) == {"corners_inconsistent"}


def test_opencv_sees_the_centroid_of_a_disc_and_we_place_its_centre():
    target = CircleGrid(columns=3, rows=5, spacing_mm=120.0, diameter_mm=100.0)
    where = pose(target)
    image = picture(target, where)
    centre = CAMERA.project(where.apply(target.points))
    outline = np.stack([outline_centroid(CAMERA.project(where.apply(target.rim(i)))) for i in range(len(centre))])
    apart = np.linalg.norm(outline - centre, axis=1)
    assert apart.max() > 0.3
    assert np.abs(detect_points(image, target).points_px - centre).max() < 0.02
    theirs = detect_points(image, target, Detector.OPENCV_SUBPIX).points_px
    assert np.abs((theirs - outline).mean(axis=0)).max() < 0.05  # thresholds of whole pixels
    assert np.linalg.norm(theirs - outline, axis=1).mean() < 0.3 * np.linalg.norm(theirs - centre, axis=1).mean()


def test_the_sense_of_corners_follows_the_print():
    chess, tags = corner_sites(PlainChessboard(columns=4, rows=3)), corner_sites(AprilGrid(columns=1, rows=1))
    np.testing.assert_array_equal(chess.sense, [1, -1, 1, -1, 1, -1])
    np.testing.assert_array_equal(tags.sense, [-1, 1, 1, -1])  # lower left, lower right, upper left, upper right


def test_nothing_is_found_where_nothing_is():
    for target in (Charuco(), AprilGrid(), CircleGrid()):
        found = detect_points(np.full((120, 160), 128, np.uint8), target)
        assert set(found.status) == {"board_not_found"}
        assert np.all(np.isnan(found.points_px))


def test_the_sector_based_finder_takes_no_markers():
    assert not takes_target(Detector.OPENCV_SB, Charuco())
    with pytest.raises(ValueError, match="'opencv-sb' does not find the target 'charuco'; choose another"):
        detect_points(np.zeros((100, 100), np.uint8), Charuco(), Detector.OPENCV_SB)


@pytest.mark.parametrize("target", [Charuco(columns=6, rows=5), CircleGrid(columns=3, rows=7, spacing_mm=80.0)])
def test_opencv_own_points_are_offered_beside_ours(target):
    found = detect_points(picture(target, pose(target)), target, Detector.OPENCV_SUBPIX)
    ok = found.status == "ok"
    assert ok.mean() > 0.9
    assert 0.0 < np.nanmax(np.abs(found.points_px - CAMERA.project(pose(target).apply(target.points)))) < 1.0
