"""A rolling shutter: truth against closed forms and OpenCV, every row against a picture of that row's pose."""

import cv2
import numpy as np
import pytest

from eposit import LENS_NAMES, Camera, Pose
from eposit.pose import rotation_from_euler
from render.frame import render_frame, render_world
from render.hybrid.prepare import baked_light, hybrid_scene
from render.light import Light
from render.motion import PoseRate, RollingPose, image_points, points_in_cam, rolling_pose
from render.pathtraced.picture import trace_picture
from render.pathtraced.tiles import Viewpoint
from render.region import target_region
from render.sensor.develop import develop
from render.sensor.presets import SensorModel
from render.targets.aprilgrid import AprilGrid
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region
from render.truth.visibility import visible_points
from render.world import World, draw_world
from render.world.boards import target_shapes
from render.world.compose import load_objects
from render.world.materials import surface
from tests.cameras import paper_camera

TARGET, LIGHT = Chessboard(), Light()
CAMERA = Camera(lens="perspective", fx=500.0, fy=501.0, cx=322.3, cy=238.6, width=640, height=480)
SMALL = CAMERA.replace(lens="equisolid", fx=60.0, fy=60.2, cx=80.3, cy=69.2, width=160, height=140)
FACING = Pose(np.eye(3), np.array([0.0, 0.0, 1400.0]) - TARGET.board_centre)
LINE_TIME_S = 30e-6
HAND = PoseRate(np.array([900.0, -600.0, 400.0]), np.array([0.4, -0.7, 1.1]))


def along(*velocity_mm_per_s):
    return PoseRate(np.array(velocity_mm_per_s), np.zeros(3))


def rolling(rate, pose=FACING, camera=CAMERA, line_time_s=LINE_TIME_S):
    return rolling_pose(pose, rate, line_time_s, camera.height)


def tilted(depth, line_time_s=1e-4, target=TARGET):
    R = rotation_from_euler(np.deg2rad([20.0, 10.0, 12.0]))
    pose = Pose(R, np.array([20.0, -10.0, depth]) - R @ target.board_centre)
    return rolling(PoseRate.about(pose, target.board_centre, *rate_of(HAND)), pose, SMALL, line_time_s)


def rate_of(rate):
    return rate.velocity_mm_per_s, rate.turn_rad_per_s


def test_without_a_line_time_the_pose_is_the_pose():
    assert rolling_pose(FACING, HAND, 0.0, 480) is FACING


def test_sideways_motion_slants_vertical_lines_by_the_known_slope():
    seen = image_points(CAMERA, rolling(along(800.0, 0.0, 0.0)), TARGET.corners)
    still = CAMERA.project(FACING.apply(TARGET.corners))
    slope = CAMERA.fx * 800.0 * LINE_TIME_S / 1400.0  # px along x for each row
    np.testing.assert_allclose(seen[:, 1], still[:, 1], rtol=0, atol=1e-9)
    np.testing.assert_allclose(seen[:, 0], still[:, 0] + slope * (still[:, 1] - 239.5), rtol=0, atol=1e-9)
    assert np.ptp(seen[:, 0] - still[:, 0]) > 1.0


@pytest.mark.parametrize("speed", [900.0, -900.0])
def test_motion_along_the_columns_stretches_by_the_known_factor(speed):
    """A point that is still at row y is seen at the row where y + k (row - middle) = row."""
    seen = image_points(CAMERA, rolling(along(0.0, speed, 0.0)), TARGET.corners)
    still = CAMERA.project(FACING.apply(TARGET.corners))[:, 1]
    k = CAMERA.fy * speed * LINE_TIME_S / 1400.0
    np.testing.assert_allclose(seen[:, 1], (still - k * 239.5) / (1.0 - k), rtol=0, atol=1e-8)


@pytest.mark.parametrize("lens", LENS_NAMES)
def test_every_point_is_seen_at_the_row_whose_pose_shows_it_there(lens):
    camera = paper_camera(lens)
    pose = rolling(HAND, FACING, camera)
    seen = image_points(camera, pose, TARGET.points)
    for pixel, point in zip(seen, TARGET.points, strict=True):
        at = pose.at_rows(pixel[1])
        np.testing.assert_allclose(camera.project(at.apply(point[None]))[0], pixel, rtol=0, atol=1e-8)


def test_a_point_beyond_the_lens_has_no_image_and_one_that_outruns_the_rows_none_either():
    points = np.vstack((TARGET.corners[:1], [[0.0, 0.0, -5000.0]]))
    seen = image_points(CAMERA, rolling(HAND), points)
    assert np.isfinite(seen[0]).all()
    assert np.isnan(seen[1]).all()
    assert np.isnan(points_in_cam(CAMERA, rolling(along(0.0, 2e5, 0.0)), TARGET.corners)).all()  # 2.1 px a row
    assert np.isnan(image_points(CAMERA, rolling(HAND), points[1:])).all()


@pytest.mark.parametrize("target", [TARGET, AprilGrid(columns=3, rows=2, tag_mm=180.0, bend_sag_mm=20.0)])
def test_each_row_of_the_closed_form_is_that_of_its_own_pose(target):
    pose = tilted(900.0, target=target)
    picture = render_frame(target, LIGHT, SMALL, pose, samples=16)
    for row in (picture.region.y + 12, 69, 90):
        region = Region(picture.region.x, row, picture.region.width, 1)
        alone = render_frame(target, LIGHT, SMALL, pose.at_rows(row), samples=16, region=region)
        np.testing.assert_array_equal(picture.radiance[row - picture.region.y], alone.radiance[0])
    middle = render_frame(target, LIGHT, SMALL, Pose(pose.R, pose.t), samples=16, region=picture.region)
    assert np.abs(picture.radiance - middle.radiance).max() > 0.2  # the rows do differ


@pytest.mark.full
def test_each_row_of_a_traced_picture_is_that_of_its_own_pose():
    world, pose = World(method="path", surround="room", path_samples=4, background_samples=4), tilted(900.0)
    draw, whole = draw_world(world, np.random.default_rng(0)), Region.whole(SMALL.width, SMALL.height)

    def film(where):
        return trace_picture(world, draw, TARGET, LIGHT, Viewpoint(SMALL, where, 5), whole, whole)

    picture = film(pose)
    for row in (20, 131):  # in the first tile of a column and in the second, which reaches beyond the picture
        np.testing.assert_allclose(picture[row], film(pose.at_rows(row))[row], rtol=0, atol=1e-5)
    assert np.abs(picture - film(Pose(pose.R, pose.t))).max() > 0.2


@pytest.mark.full
def test_each_row_of_a_hybrid_picture_is_that_of_its_own_pose():
    target = Chessboard(columns=5, rows=4)
    world = World(method="hybrid", bake_samples=8, surround="room", surface="rough_plastic", path_samples=4)
    draw, pose = draw_world(world, np.random.default_rng(4)), tilted(800.0, target=target)
    scene = hybrid_scene(world, draw, target, LIGHT, baked_light(world, draw, target, LIGHT))
    region = target_region(target, SMALL, pose)

    def picture(where):
        return scene.region(SMALL, where, region, cells=16, seed=3)

    rolled = picture(pose)
    for row in (10, region.height // 2):
        alone = picture(pose.at_rows(region.y + row))[row]
        np.testing.assert_allclose(rolled[row], alone, rtol=0, atol=1e-5)
    assert np.abs(rolled[10] - picture(Pose(pose.R, pose.t))[10]).max() > 0.02
    view = Viewpoint(SMALL, pose, 3)
    whole = render_world(world, draw, target, LIGHT, view, samples=16, in_colour=True)
    np.testing.assert_allclose(whole.radiance, rolled, rtol=0, atol=1e-6)


@pytest.mark.parametrize("rate", [along(900.0, 0.0, 0.0), HAND])
def test_opencv_finds_the_corners_where_truth_has_them(rate):
    pose = rolling(rate)
    linear = render_frame(TARGET, LIGHT, CAMERA, pose, samples=64)
    image = develop(linear.full(CAMERA), SensorModel())
    found, corners = cv2.findChessboardCorners(image, TARGET.inner)
    assert found
    criteria = cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4
    corners = cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), criteria).reshape(-1, 2).astype(float)
    truth = image_points(CAMERA, pose, TARGET.corners)
    error = corners[np.argmin(np.linalg.norm(truth[:, None] - corners, axis=2), axis=1)] - truth
    # OpenCV's own scatter at corners of this size is 0.02 px; the pose of the middle row by up to 1 px.
    assert np.abs(error.mean(axis=0)).max() < 0.01
    assert np.sqrt(np.mean(error**2)) < 0.04
    still = CAMERA.project(FACING.apply(TARGET.corners))
    assert np.sqrt(np.mean((truth - still) ** 2)) > 0.3


def test_what_hides_a_point_is_asked_from_where_its_row_is_exposed():
    """The camera passes the board's plane while the rows are read: only those before see its front."""
    scene = load_objects(target_shapes(TARGET, lambda reflectance: surface("matt", 0.0, reflectance)))
    wide = Camera(lens="equidistance", fx=100.0, fy=100.0, cx=199.5, cy=199.5, width=400, height=400)
    beside = Pose(rotation_from_euler(np.array([0.0, np.pi / 2 - 0.02, 0.0])), np.array([0.0, 0.0, 900.0]))
    pose = RollingPose(beside.R, beside.t, PoseRate(np.zeros(3), np.array([0.0, 10.0, 0.0])), 1e-4, 400)
    visible = visible_points(scene, np.eye(4), TARGET.corners, wide, pose)
    seen = points_in_cam(wide, pose, TARGET.corners)
    rows = image_points(wide, pose, TARGET.corners)[:, 1]
    normals = pose.at_rows(rows).R[..., 2]
    np.testing.assert_array_equal(visible, np.sum(normals * seen, axis=1) > 0.0)
    assert 0 < visible.sum() < len(visible)
