"""Colours with focal lengths of their own and open pupils: against plain pictures, OpenCV, and rays cast one by one."""

import dataclasses

import cv2
import numpy as np
import pytest

from eposit import Camera, Pose
from eposit.pose import rotation_from_euler
from render.analytic.image_circle import lens_coverage
from render.frame import render_frame, render_world
from render.light import Light
from render.motion import PoseRate, rolling_pose
from render.optics import Optics
from render.pathtraced.tiles import Viewpoint
from render.pupil import Pupil
from render.region import target_region
from render.sensor.develop import develop
from render.sensor.presets import SensorModel
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region
from render.targets.plain_chessboard import PlainChessboard
from render.world import World, draw_world
from tests.render.analytic import ray_cast

TARGET, LIGHT = Chessboard(), Light()
EVEN = Light(ambient_share=1.0, lamp_side_mm=0.1)  # light from everywhere, so that a flat board is lit evenly
PLAIN = PlainChessboard(columns=7, rows=4, square_mm=120.0, margin_mm=0.0)
CAMERA = Camera(lens="perspective", fx=500.0, fy=501.0, cx=322.3, cy=238.6, width=640, height=480)
FISHEYE = CAMERA.replace(lens="equisolid", fx=230.0, fy=230.6)
CHROMATIC = Optics(red_focal=1.004, blue_focal=0.995)
CLOSED = World(method="closed")


def pose(tilt=25.0, depth=1400.0, target=TARGET):
    R = rotation_from_euler(np.deg2rad([tilt, 0.5 * tilt, 12.0]))
    return Pose(R, np.array([20.0, -10.0, depth]) - R @ target.board_centre)


def picture(view, world=CLOSED, target=TARGET, light=LIGHT, in_colour=True):
    draw = draw_world(world, np.random.default_rng(3))
    return render_world(world, draw, target, light, view, samples=64, in_colour=in_colour)


@pytest.mark.parametrize("camera", [CAMERA, FISHEYE])
def test_opencv_finds_each_colours_corners_where_its_focal_length_has_them(camera):
    where = pose(depth=1000.0 if camera is FISHEYE else 1400.0)
    image = develop(picture(Viewpoint(camera, where, 0, CHROMATIC)).full(camera), SensorModel())
    criteria = cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4
    green = camera.project(where.apply(TARGET.corners))
    for i, focal in enumerate((1.004, 1.0, 0.995)):
        channel = np.ascontiguousarray(image[..., i])
        start = np.ascontiguousarray(green, np.float32)
        found = cv2.cornerSubPix(channel, start, (5, 5), (-1, -1), criteria).reshape(-1, 2).astype(float)
        centre = np.array([camera.cx, camera.cy])
        error = found - (centre + focal * (green - centre))
        # OpenCV's own scatter at corners of this size is 0.02 px; the wrong colour is off by 0.3 px and more.
        assert np.abs(error.mean(axis=0)).max() < 0.02
        assert np.sqrt(np.mean(error**2)) < 0.04
        # Displacements from green are radial: their rate is the focal length's, known within 0.03 px over 100.
        away = green - centre
        assert np.sum((found - green) * away) / np.sum(away * away) == pytest.approx(focal - 1.0, abs=3e-4)


def test_a_colour_has_the_bits_of_a_picture_with_its_focal_length():
    found = picture(Viewpoint(CAMERA, pose(), 0, CHROMATIC))
    for i, camera in enumerate(CHROMATIC.channel_cameras(CAMERA)):
        alone = render_frame(TARGET, LIGHT, camera, pose(), samples=64, region=found.region)
        np.testing.assert_array_equal(found.radiance[..., i], alone.radiance)
        own = target_region(TARGET, camera, pose())
        assert found.region.x <= own.x
        assert found.region.x + found.region.width >= own.x + own.width


def test_the_image_circle_has_a_coloured_rim():
    wide = CAMERA.replace(lens="orthogonal", fx=200.0, fy=200.0)
    whole = picture(Viewpoint(wide, pose(), 0, CHROMATIC)).full(wide)
    light = [np.mean(whole[:60, :, i]) for i in range(3)]
    assert light[0] > light[1] > light[2]
    np.testing.assert_array_equal(whole[:30, :, 1], np.float32(LIGHT.background) * lens_coverage(wide)[:30])


def test_grey_pictures_have_one_focal_length():
    with pytest.raises(ValueError, match="in colour only"):
        picture(Viewpoint(CAMERA, pose(), 0, CHROMATIC), in_colour=False)


@pytest.mark.full
@pytest.mark.parametrize("method", ["path", "hybrid"])
def test_traced_colours_are_those_of_plain_pictures(method):
    target = Chessboard(columns=5, rows=4)
    world = World(method=method, path_samples=4, background_samples=1, bake_samples=8)
    small = CAMERA.replace(lens="equisolid", fx=60.0, fy=60.2, cx=80.3, cy=69.2, width=160, height=140)
    optics = Optics(red_focal=1.01, blue_focal=0.99)
    found = picture(Viewpoint(small, pose(), 4, optics), world, target)
    for i, camera in enumerate(optics.channel_cameras(small)):
        alone = picture(Viewpoint(camera, pose(), 4), world, target).full(camera)
        inner = target_region(target, camera, pose()).pixels
        np.testing.assert_allclose(found.full(small)[..., i][inner], alone[..., i][inner], rtol=0, atol=1e-6)


def test_the_circle_of_confusion_is_that_of_a_thin_lens_on_the_axis():
    pupil, far = Pupil(5.0, 1200.0), np.array([[0.0, 0.0, 2000.0]])
    expected = CAMERA.fy * 5.0 * (1.0 / 1200.0 - 1.0 / 2000.0)  # along y; fx is smaller
    assert pupil.blur_radius_px(CAMERA, far) == pytest.approx(expected, rel=1e-5)
    assert pupil.blur_radius_px(CAMERA, np.array([[300.0, -400.0, 1090.871]])) < 1e-3  # 1200 mm away
    with pytest.raises(ValueError, match="out of focus by up to"):
        Pupil(50.0, 200.0).blur_radius_px(CAMERA, far)


@pytest.mark.parametrize("blur_px", [0.3, 2.0, 7.0])
def test_places_of_the_pupil_are_a_disc(blur_px):
    places = list(Pupil(4.0, 1000.0).places(blur_px))
    at, weight = np.array([place for place, _ in places]), np.array([share for _, share in places])
    assert weight.sum() == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(weight @ at, 0.0, atol=1e-12)
    np.testing.assert_allclose((at * weight[:, None]).T @ at, np.eye(2) * 4.0, atol=1e-12)  # radius squared over 4
    assert weight @ np.sum(at**2, axis=1) ** 2 == pytest.approx(4.0**4 / 3.0)  # of a disc


def through_pupil(camera, where, region, pupil, side=4, places=300):
    """(height, width) shares of the board and its black, by places of a pupil perpendicular to each ray.

    The places are a sunflower's, and the pupil's axes others than the renderer's.
    """
    grid, (height, width) = (np.arange(side) + 0.5) / side - 0.5, (region.height, region.width)
    y = (region.y + np.arange(height)[:, None] + grid).ravel()
    x = (region.x + np.arange(width)[:, None] + grid).ravel()
    ray = camera.bearing(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))
    across = np.cross((0.0, 1.0, 0.0), ray)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    down, shares = np.cross(ray, across), np.zeros((2, height, width))
    for i in range(places):
        radius, angle = pupil.radius_mm * np.sqrt((i + 0.5) / places), i * np.pi * (3.0 - np.sqrt(5.0))
        start = radius * (np.cos(angle) * across + np.sin(angle) * down)
        way, start = (pupil.focus_mm * ray - start) @ where.R, (start - where.t) @ where.R
        at = (start - (start[:, 2] / way[:, 2])[:, None] * way)[:, :2]
        on = ray_cast._is_on_board(PLAIN, at)
        for share, hit in zip(shares, (on, on & ray_cast._is_black(PLAIN, at)), strict=True):
            share += hit.reshape(height, side, width, side).mean(axis=(1, 3)) / places
    return shares


@pytest.mark.full
@pytest.mark.parametrize("camera", [CAMERA, FISHEYE])
def test_an_open_pupil_is_the_mean_of_rays_cast_one_by_one(camera):
    """A tilted board: its first point is out of focus by 3 px, its last is sharp.

    The fish-eye lens has both at nearly the same distance: its pupil is wide, and the blur changes over a square.
    """
    camera = camera.replace(fx=0.5 * camera.fx, fy=0.5 * camera.fy, cx=160.9, cy=119.3, width=320, height=240)
    where = pose(45.0, 900.0 if camera is FISHEYE else 1300.0, PLAIN)
    first, last = np.linalg.norm(where.apply(PLAIN.points)[[0, -1]], axis=1)
    pupil = Pupil(3.0 / (camera.fx * abs(1.0 / first - 1.0 / last)), last)
    found = render_frame(PLAIN, EVEN, camera, where, samples=64, pupil=pupil)
    steepest = []
    for x, y in np.rint(camera.project(where.apply(PLAIN.points))[[0, -1]]).astype(int):
        region = Region(int(x) - 8, int(y) - 8, 17, 17)
        board, black = through_pupil(camera, where, region, pupil)
        expected = board + black * (PLAIN.black / PLAIN.white - 1.0) + EVEN.background * (1.0 - board)
        part = found.radiance[y - 8 - found.region.y :, x - 8 - found.region.x :][:17, :17]
        grey = 255.0 * 0.8 * (part - expected)
        steepest.append(np.abs(np.diff(expected, axis=1)).max())
        # Measured 0.2 to 0.6 of 204 levels. Two edges 0.01 px off would change the mean by 0.2.
        assert np.sqrt(np.mean(grey**2)) < 1.0
        assert abs(grey.mean()) < 0.1
    if camera.lens == "perspective":
        assert steepest[0] < 0.3
        assert steepest[1] > 0.4


def test_rows_and_pupil_and_colours_go_together():
    """Each colour of each row through the pupil is that of the row's own pose and the colour's own camera."""
    optics = Optics(line_time_us=100.0, red_focal=1.004, aperture_mm=2.0, focus_mm=1800.0)
    camera = CAMERA.replace(fx=250.0, fy=250.5, cx=160.9, cy=119.3, width=320, height=240)
    rolled = rolling_pose(pose(), PoseRate(np.array([900.0, 0.0, 0.0]), np.zeros(3)), optics.line_time_s, 240)
    found = picture(Viewpoint(camera, rolled, 0, optics))
    row = found.region.height // 3
    alone = picture(Viewpoint(camera, rolled.at_rows(found.region.y + row), 0, optics)).full(camera)
    left = slice(found.region.x, found.region.x + found.region.width)
    np.testing.assert_allclose(found.radiance[row], alone[found.region.y + row, left], rtol=0, atol=1e-6)


@pytest.mark.full
def test_the_path_tracer_sees_through_the_same_pupil():
    optics = Optics(aperture_mm=50.0, focus_mm=2000.0)
    small = CAMERA.replace(lens="equisolid", fx=60.0, fy=60.2, cx=80.3, cy=69.2, width=160, height=140)
    view = Viewpoint(small, pose(40.0, 700.0), 4, optics)
    world = World(method="path", path_samples=1024, path_depth=2)
    theirs, ours, sharp = (
        picture(view, world, in_colour=False), picture(view, in_colour=False),
        picture(dataclasses.replace(view, optics=Optics()), in_colour=False),
    )  # fmt: skip
    assert theirs.region == ours.region
    grey = 204.0 * (theirs.radiance - ours.radiance)
    blur = 204.0 * (theirs.radiance - sharp.full(small)[ours.region.pixels])
    # 1024 rays with one of the lamp's each leave 0.8 grey levels in a pixel.
    assert np.sqrt(np.mean(grey**2)) < 1.2
    assert np.sqrt(np.mean(grey**2)) < 0.2 * np.sqrt(np.mean(blur**2))
    assert abs(grey.mean()) < 0.1


def test_hybrid_pictures_are_sharp():
    with pytest.raises(ValueError, match="use closed or path"):
        picture(Viewpoint(CAMERA, pose(), 0, Optics(aperture_mm=5.0, focus_mm=1000.0)), World(method="hybrid"))
