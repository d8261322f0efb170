"""Truth of pixels and points against closed forms."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from eposit import Camera, Pose
from eposit.pose import rotation_from_euler
from render import backend
from render.frame_truth import truth_of
from render.light import Light
from render.targets.chessboard import Chessboard
from render.truth.pixels import pixel_truth
from render.truth.visibility import visible_points
from render.world import World, draw_world
from render.world.boards import target_shapes
from render.world.compose import load_objects
from render.world.materials import diffuse, surface
from render.world.shapes import ball, pole

TARGET, LIGHT = Chessboard(), Light()
CAMERA = Camera(lens="equisolid", fx=60.0, fy=60.2, cx=80.3, cy=69.2, width=160, height=140)
POSE = Pose(rotation_from_euler(np.deg2rad([20.0, -10.0, 15.0])), np.array([-350.0, -200.0, 1500.0]))
GREY = diffuse((0.5, 0.5, 0.5))
SIMILARITIES = {
    "object frame": np.eye(4),
    "metres, turned and moved": np.block(
        [
            [rotation_from_euler(np.deg2rad([30.0, 50.0, -70.0])) / 1000.0, np.array([[5.0], [-3.0], [2.0]])],
            [np.zeros((1, 3)), np.ones((1, 1))],
        ]
    ),
}


def rays():
    """(height, width, 3) unit bearings of pixel centres, NaN beyond the lens."""
    x, y = np.meshgrid(np.arange(CAMERA.width, dtype=float), np.arange(CAMERA.height, dtype=float))
    return CAMERA.bearing(np.stack((x, y), axis=-1))


@pytest.mark.parametrize("name", SIMILARITIES)
def test_a_ball_has_the_closed_forms_depth_range_and_normal(name):
    centre, radius = np.array([400.0, 250.0, 100.0]), 320.0
    matrix = SIMILARITIES[name]
    truth = pixel_truth(load_objects({"ball": ball(centre, radius, GREY)}, matrix), matrix, ("ball",), CAMERA, POSE)
    in_cam, bearing = POSE.apply(centre[None])[0], rays()
    along = bearing @ in_cam
    inside = radius**2 - (in_cam @ in_cam - along**2)
    hit = inside > 100.0  # mm^2; closer to the rim a float32 ray may miss
    distance = along - np.sqrt(np.maximum(inside, 0.0))
    np.testing.assert_allclose(truth.range_mm[hit], distance[hit], rtol=1e-4)
    np.testing.assert_allclose(truth.depth_mm[hit], (distance * bearing[..., 2])[hit], rtol=1e-4)
    normal = (distance[..., None] * bearing - in_cam) / radius
    np.testing.assert_allclose(truth.normal[hit], normal[hit], atol=2e-3)
    assert np.all(truth.object_id[hit] == 1)
    missed = ~(inside > -100.0)
    assert missed.sum() > 5000
    assert np.all(truth.object_id[missed] == 0)
    assert np.all(np.isinf(truth.range_mm[missed]) & np.isinf(truth.depth_mm[missed]))
    assert np.all(truth.normal[missed] == 0.0)


@pytest.mark.parametrize("name", SIMILARITIES)
def test_the_board_is_a_plane_and_the_circle_lies_before_it(name):
    shapes = target_shapes(TARGET, lambda reflectance: surface("matt", 0.0, reflectance))
    matrix = SIMILARITIES[name]
    truth = pixel_truth(load_objects(shapes, matrix), matrix, tuple(shapes), CAMERA, POSE)
    normal, centre = -POSE.R[:, 2], POSE.inverse().t
    for number, z in ((1, 0.0), (2, -TARGET.circle_height_mm)):
        seen = truth.object_id == number
        assert seen.sum() > (1000 if number == 1 else 3)
        expected = (z - centre[2]) / (rays() @ POSE.R)[seen][:, 2]
        np.testing.assert_allclose(truth.range_mm[seen], expected, rtol=1e-5)
        np.testing.assert_allclose(truth.normal[seen], np.broadcast_to(normal, (seen.sum(), 3)), atol=1e-5)


def test_what_the_lens_does_not_see_is_nothing():
    camera = CAMERA.replace(lens="orthogonal", fx=50.0, fy=50.0)
    scene = load_objects({"ball": ball(POSE.inverse().t, 900.0, GREY)})  # all around the camera
    truth = pixel_truth(scene, np.eye(4), ("ball",), camera, POSE)
    radius = np.hypot(*np.meshgrid(np.arange(160) - camera.cx, np.arange(140) - camera.cy)) / 50.0
    assert np.all((truth.object_id == 1) == (radius <= 1.0))
    np.testing.assert_allclose(truth.range_mm[radius <= 1.0], 900.0, rtol=1e-5)


def board_with(**things):
    return load_objects(things | target_shapes(TARGET, lambda reflectance: surface("matt", 0.0, reflectance)))


def test_a_pole_hides_the_column_of_corners_behind_it():
    eye = POSE.inverse().t
    column = TARGET.corners.reshape(6, 9, 3)[:, 4]
    middle = 0.7 * column + 0.3 * eye
    scene = board_with(pole=pole(middle[0] - 20.0 * (middle[5] - middle[0]), middle[5], 5.0, GREY))
    visible = visible_points(scene, np.eye(4), TARGET.points, CAMERA, POSE)
    hidden = np.flatnonzero(~visible)
    assert set(hidden) == {4, 13, 22, 31, 40} | ({49} & set(hidden))  # the last one lies at the pole's end
    assert visible_points(board_with(), np.eye(4), TARGET.points, CAMERA, POSE).all()


def test_points_beyond_the_picture_behind_the_board_or_without_a_board_are_hidden():
    scene = board_with()
    narrow = CAMERA.replace(width=70)
    visible = visible_points(scene, np.eye(4), TARGET.points, narrow, POSE)
    x = narrow.project(POSE.apply(TARGET.points))[:, 0]
    np.testing.assert_array_equal(visible, x < 69.5)
    turned = Pose(POSE.R @ np.diag([-1.0, 1.0, -1.0]), POSE.t + np.array([700.0, 0.0, 0.0]))
    assert not visible_points(scene, np.eye(4), TARGET.points, CAMERA, turned).any()
    absent = visible_points(scene, np.eye(4), TARGET.points, CAMERA, POSE, has_target=False)
    assert not absent.any()


def test_the_disc_hides_a_corner_from_a_flat_view():
    """From 80 degrees off the normal a disc 80 mm high hides what lies 454 mm behind its centre."""
    high = dataclasses.replace(TARGET, circle_height_mm=80.0, circle_radius_mm=40.0)
    scene = load_objects(target_shapes(high, lambda reflectance: surface("matt", 0.0, reflectance)))
    point = np.array([0.0, 0.0, 0.0])
    towards = high.circle_centre - point
    eye = point + 12.0 * towards
    R = rotation_from_euler(np.zeros(3))
    wide = CAMERA.replace(lens="equidistance", fx=20.0, fy=20.0)
    visible = visible_points(scene, np.eye(4), high.points, wide, Pose(R, -R @ eye))
    assert not visible[0]
    assert visible[-1]


def test_truth_of_a_world_names_its_objects():
    backend.load()
    world = World(method="path", surround="room", clutter=(2, 2), path_samples=1, background_samples=1)
    truth = truth_of(world, draw_world(world, np.random.default_rng(1)), TARGET, LIGHT, CAMERA, POSE)
    pixels = truth.pixels()
    shown = {pixels.names[number - 1] for number in np.unique(pixels.object_id) if number}
    assert {"board", "circle", "wall_back"} <= shown
    assert truth.visible().all()
