"""Where the target stands and how it moves: field angles, scatter, rates."""

import dataclasses

import numpy as np
import pytest

from datasets.errors import UserError
from datasets.plan import plan
from datasets.recipe.model import load_recipe, parse_recipe
from datasets.trajectories.field import FieldAngles
from datasets.trajectories.helix import Helix
from datasets.trajectories.scatter import Scatter
from eposit.pose import rotation_error_rad, rotation_error_vector, tilt_rad
from render.targets.chessboard import Chessboard

TARGET = Chessboard()
BASE = """\
name = "x"
[[cameras]]
name = "a"
lens = "equisolid"
fx = 276.0
fy = 276.0
cx = 399.5
cy = 299.5
width = 800
height = 600
"""


def recipe(trajectory, camera="", seed=0):
    return parse_recipe(f"seed = {seed}\n{BASE}{camera}\n[trajectory]\n{trajectory}", "x")


def angle_deg(a, b):
    """Angle between vectors by its half chord, which is exact near 0."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    return np.degrees(2.0 * np.arctan2(np.linalg.norm(a - b), np.linalg.norm(a + b)))


def centre(pose):
    return pose.apply(TARGET.board_centre[None])[0]


def test_field_angles_distances_and_azimuths_are_those_given():
    path = FieldAngles(field_deg=(0.0, 35.0, 80.0), distance_mm=(700.0, 1500.0), azimuth_deg=(10.0, 190.0))
    poses = (path.pose(i, TARGET) for i in range(path.count))
    for field in path.field_deg:
        for distance in path.distance_mm:
            for azimuth in path.azimuth_deg:
                pose = next(poses)
                place = centre(pose)
                assert np.linalg.norm(place) == pytest.approx(distance, rel=1e-12)
                assert angle_deg(place, np.array([0.0, 0.0, 1.0])) == pytest.approx(field, abs=1e-9)
                if field:
                    assert np.degrees(np.arctan2(place[1], place[0])) % 360 == pytest.approx(azimuth)
                assert angle_deg(pose.R[:, 2], place) == pytest.approx(10.0, abs=1e-9)  # the extra tilt
                np.testing.assert_allclose(pose.R @ pose.R.T, np.eye(3), atol=1e-12)
                assert np.linalg.det(pose.R) > 0
    assert next(poses, None) is None


def test_the_rows_of_the_board_run_along_the_field_angle():
    path = FieldAngles(field_deg=(60.0,), azimuth_deg=(40.0,), extra_tilt_deg=0.0)
    pose = path.pose(0, TARGET)
    fields = [
        angle_deg(p, np.array([0, 0, 1.0])) for p in pose.apply(TARGET.board_centre + [[0, -250, 0], [0, 250, 0]])
    ]
    # Facing from 1500 mm, 250 mm are seen under atan(1/6), all of it as field angle.
    np.testing.assert_allclose(fields, 60.0 + np.degrees(np.arctan(1 / 6.0)) * np.array([1, -1]), atol=1e-9)
    sideways = dataclasses.replace(path, roll_deg=90.0).pose(0, TARGET)
    assert angle_deg(sideways.R[:, 0], pose.R[:, 1]) == pytest.approx(0.0, abs=1e-9)


def test_azimuths_can_be_counted():
    path = FieldAngles(azimuth_deg=4)
    assert [path.azimuth(i) for i in range(path.count)] == [0.0, 90.0, 180.0, 270.0]


def test_a_camera_is_not_planned_beyond_its_field():
    wide, _ = load_recipe("wide")
    limits = {camera.name: camera.max_field_deg for camera in wide.cameras}
    assert limits["perspective"] == 30.0
    seen = {}
    for frame in plan(wide):
        seen.setdefault(frame.camera.name, set()).add(
            round(angle_deg(centre(frame.cam_from_obj), np.array([0, 0, 1.0])))
        )
    assert seen["perspective"] == {0, 15, 30}
    assert seen["stereographic"] == {0, 15, 30, 45, 60}
    assert seen["orthogonal"] == {0, 15, 30, 45, 60, 75}
    assert [frame.frame_id for frame in plan(wide)] == list(range(len(plan(wide))))
    narrow = recipe('kind = "field"\nfield_deg = [20]', camera="max_field_deg = 10")
    with pytest.raises(UserError, match="camera a sees no pose, as max_field_deg is 10"):
        plan(narrow)


@pytest.mark.parametrize(("name", "low", "high"), [("accuracy", 0.0, 30.0), ("accuracy-steep", 45.0, 72.0)])
def test_scattered_tilts_lie_in_their_range_and_fill_it(name, low, high):
    scattered, _ = load_recipe(name)
    frames = plan(scattered)
    assert len(frames) == 400
    poses = [frame.cam_from_obj for frame in frames[::5]]
    tilts = np.degrees([tilt_rad(pose.R) for pose in poses])
    assert low <= tilts.min() < low + 0.15 * (high - low)
    assert high - 0.15 * (high - low) < tilts.max() <= high
    # Uniform: mean of 40 has a standard error of range / sqrt(480).
    assert abs(tilts.mean() - 0.5 * (low + high)) < 3.0 * (high - low) / np.sqrt(480.0)
    towards = np.array([pose.R[:2, 2] / np.linalg.norm(pose.R[:2, 2]) for pose in poses])
    assert np.linalg.norm(towards.mean(axis=0)) < 3.0 / np.sqrt(40.0)  # unit vectors in all directions
    for pose in poses:
        assert centre(pose)[2] == pytest.approx(2000.0, rel=1e-12)
        assert np.hypot(*centre(pose)[:2]) <= 300.0
    for frame in frames:
        camera = frame.camera.true_camera()
        assert np.all(camera.contains(camera.project(frame.cam_from_obj.apply(TARGET.points))))


def test_offsets_are_even_over_the_disc():
    rng, path = np.random.default_rng(0), Scatter(offset_range_mm=(100.0, 300.0))
    camera = recipe('kind = "scatter"').cameras[0].true_camera()
    places = [centre(path.pose(rng, TARGET, camera, lambda pose: True))[:2] for _ in range(2000)]
    radius = np.linalg.norm(places, axis=1)
    assert radius.min() >= 100.0
    assert radius.max() <= 300.0
    share = np.mean(radius < 200.0)  # 3 of 8 parts of the ring's area
    assert share == pytest.approx(3.0 / 8.0, abs=4.0 * np.sqrt(0.375 * 0.625 / 2000))


def test_over_the_picture_means_over_its_pixels():
    rng, path = np.random.default_rng(0), Scatter(offset_range_mm="picture", depth_range_mm=(800.0, 1200.0))
    camera = recipe('kind = "scatter"').cameras[0].true_camera()
    poses = [path.pose(rng, TARGET, camera, lambda pose: True) for _ in range(1000)]
    pixels = camera.project([centre(pose) for pose in poses])
    assert np.all(camera.contains(pixels))
    # A uniform share of the width and height: means at the middle within four standard errors.
    np.testing.assert_allclose(pixels.mean(axis=0), [399.5, 299.5], atol=4 * 800 / np.sqrt(12 * 1000))


def test_a_pose_does_not_depend_on_how_many_there_are():
    few, many = (plan(recipe(f'kind = "scatter"\ncount = {n}')) for n in (3, 6))
    for a, b in zip(few, many, strict=False):
        np.testing.assert_array_equal(a.cam_from_obj.R, b.cam_from_obj.R)
        np.testing.assert_array_equal(a.rate.velocity_mm_per_s, b.rate.velocity_mm_per_s)
        assert (a.render_seed, a.sensor_seed) == (b.render_seed, b.sensor_seed)
    other = plan(recipe('kind = "scatter"\ncount = 3', seed=1))
    assert np.any(other[0].cam_from_obj.t != few[0].cam_from_obj.t)
    assert len({frame.sensor_seed for frame in many}) == 6


def test_a_scatter_that_cannot_be_is_refused_in_words():
    with pytest.raises(UserError, match="pose 0: none of 2000 random poses"):
        plan(recipe('kind = "scatter"\ndepth_range_mm = [50, 60]'))


def test_the_helix_moves_at_its_derivative():
    path, time, step = Helix(), 40.0, 1e-2
    view = path.view(time, TARGET)
    angle = np.deg2rad(85.0)
    expected = np.array([-np.sin(angle), np.cos(angle), 0.0]) * path.radius_mm * np.deg2rad(1.0) + [0, 0, 0.25]
    # The board's centre is carried: the origin's velocity and the turn about it give the helix's.
    arm = view.cam_from_obj.R @ TARGET.board_centre
    velocity = view.rate.velocity_mm_per_s + np.cross(view.rate.turn_rad_per_s, arm)
    np.testing.assert_allclose(velocity, expected, atol=1e-7)
    later = path.cam_from_obj(time + step, TARGET)
    # Beyond even motion comes half the acceleration times the step squared: 0.04 mm/s^2, 1e-6 rad/s^2.
    np.testing.assert_allclose(view.rate.moved(view.cam_from_obj, step).t, later.t, atol=0.5 * 0.06 * step**2)
    assert rotation_error_rad(view.rate.moved(view.cam_from_obj, step).R, later.R) < 1e-5 * step**2


def test_a_hand_moves_the_centre_and_turns_the_board_as_fast_as_it_says():
    frames = plan(recipe('kind = "scatter"\ncount = 4\nspeed_mm_per_s = 80\nturn_deg_per_s = 6'))
    directions = []
    for frame in frames:
        before, after = (frame.rate.moved(frame.cam_from_obj, s) for s in (-1e-3, 1e-3))
        velocity = (centre(after) - centre(before)) / 2e-3
        assert np.linalg.norm(velocity) == pytest.approx(80.0, rel=1e-6)
        turn = rotation_error_vector(after.R, before.R) / 2e-3
        assert np.degrees(np.linalg.norm(turn)) == pytest.approx(6.0, rel=1e-9)
        directions.append(velocity / 80.0)
    assert np.abs(np.triu(np.array(directions) @ np.array(directions).T, 1)).max() < 0.999
    still = plan(recipe('kind = "field"\nspeed_mm_per_s = 0\nturn_deg_per_s = 0'))[0].rate
    assert not np.any(still.velocity_mm_per_s)
    assert not np.any(still.turn_rad_per_s)
