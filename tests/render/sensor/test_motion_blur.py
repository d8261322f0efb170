"""Blur by motion against closed forms of moving edges and renders of the moved board."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import norm

from eposit import Pose
from eposit.pose import rotation_from_euler
from render.frame import render_frame
from render.light import Light
from render.motion import PoseRate
from render.sensor.develop import develop
from render.sensor.motion import Exposure, at_pixels
from render.sensor.motion_blur import MIN_MOTION_PX, SHORT_MOTION_PX
from render.sensor.presets import SensorModel
from tests.render.sensor.frames import BARE, CAMERA, TARGET, WHOLE, shot


def blurred_edge(x, way, sigma):
    """A step at 0 that goes a way about there, seen through a gaussian: the integral of its distribution function."""

    def integral(u):
        return u * norm.cdf(u / sigma) + sigma * norm.pdf(u / sigma)

    return norm.cdf(x / sigma) if way == 0.0 else (integral(x + way / 2) - integral(x - way / 2)) / way


@pytest.mark.parametrize("way", [0.3, 0.49, 1.0, 3.0, 8.0])
def test_motion_is_an_even_way_about_the_middle(way):
    """An edge goes `way` px while the board moves; it widens by the closed form and stays where it is."""
    sigma, place = 1.0, 199.5 + 0.27
    rate = PoseRate(np.array([way * 2000.0 / 400.0 / 0.01, 0.0, 0.0]), np.zeros(3))  # px to mm at 2 m, in 10 ms
    x = np.arange(400) - place
    light = np.tile(norm.cdf(x / sigma), (300, 1)).astype(np.float32)
    model = dataclasses.replace(BARE, exposure_s=0.01)
    grey = develop(light, model, shot(rate=rate)).astype(float)[150]
    expected = 255.0 * blurred_edge(x, way, sigma)
    near = np.abs(x) < 30
    # Half a grey level of rounding; the nine weights of short ways are within 0.2 and Lanczos within 0.3 of the truth.
    assert np.abs(grey - expected)[near].max() < (0.75 if way <= SHORT_MOTION_PX else 0.85)
    # The middle of the edge from its moment: 60 roundings of 0.3 px shift it by 0.3 sqrt(60) / 255 = 0.009.
    assert np.sum(grey[near] - 255.0 * (x[near] > 0)) / 255.0 == pytest.approx(
        np.sum(expected[near] - 255.0 * (x[near] > 0)) / 255.0, abs=0.02
    )


@pytest.mark.parametrize("way", [0.45, 2.0])
@pytest.mark.parametrize("along", [False, True])
def test_only_motion_across_an_edge_blurs_it(way, along):
    """An edge at 0.6 rad, so that its pixels lie at all distances from it, and motion across or along it."""
    across, aside = np.array([np.cos(0.6), np.sin(0.6)]), np.array([-np.sin(0.6), np.cos(0.6)])
    x, y = np.meshgrid(np.arange(400) - 199.3, np.arange(300) - 149.6)
    distance = across[0] * x + across[1] * y
    velocity = np.append(aside if along else across, 0.0) * way * 5.0 / 0.01
    model = dataclasses.replace(BARE, exposure_s=0.01)
    light = norm.cdf(distance).astype(np.float32)
    grey = develop(light, model, shot(rate=PoseRate(velocity, np.zeros(3)))).astype(float)
    expected = 255.0 * blurred_edge(distance, 0.0 if along else way, 1.0)
    error = (grey - expected)[(np.abs(distance) < 2.0) & (np.abs(y) < 60)]
    # Half a level of rounding. OpenCV rounds places to 1/32 px, by up to 1/64 px, where the edge rises 100 levels a px;
    # of those 1.6 levels the mean of four moments keeps a third.
    assert np.abs(error).max() < 1.0
    # Rounding alone is 0.29, that of the places adds as much again. In short ways the wrong diagonal would add half the
    # variance, way^2 / 24, times the bend of the edge, up to 62 grey levels per px^2: 0.5 at the least.
    assert np.sqrt(np.mean(error**2)) < (0.36 if way <= SHORT_MOTION_PX else 0.45)


def test_a_way_too_short_to_be_seen_changes_nothing():
    light = np.random.default_rng(0).uniform(0.0, 1.0, (300, 400)).astype(np.float32)
    rate = PoseRate(np.array([0.9 * MIN_MOTION_PX * 5.0 / 0.01, 0.0, 0.0]), np.zeros(3))
    model = dataclasses.replace(BARE, exposure_s=0.01)
    np.testing.assert_array_equal(develop(light, model, shot(rate=rate)), develop(light, BARE))


@pytest.mark.parametrize("lens", ["perspective", "orthogonal"])
def test_the_way_of_a_pixel_is_that_of_the_board(lens):
    camera = CAMERA.replace(lens=lens, fx=180.0, fy=181.0)
    R = rotation_from_euler(np.deg2rad([30.0, 20.0, 15.0]))
    pose = Pose(R, np.array([50.0, -30.0, 1300.0]) - R @ TARGET.board_centre)
    rate = PoseRate(np.array([90.0, -60.0, 120.0]), np.array([0.2, -0.4, 0.5]))
    way_x, way_y = at_pixels(Exposure(TARGET, camera, pose, rate, 0.05).displacement(WHOLE), 400, 300)
    ends = [camera.project(rate.moved(pose, s).apply(TARGET.corners)) for s in (0.025, -0.025)]
    pixels = np.rint(camera.project(pose.apply(TARGET.corners))).astype(int)
    found = np.stack((way_x, way_y), axis=-1)[pixels[:, 1], pixels[:, 0]]
    # Corners lie up to 0.7 px beside their pixel; the turn of 0.03 rad alone changes the way by 0.02 px over that.
    np.testing.assert_allclose(found, ends[0] - ends[1], atol=0.03)
    assert np.hypot(way_x, way_y).max() < 3.0 * np.hypot(*(ends[0] - ends[1]).T).max()  # bounded beyond the board


def test_the_blur_is_the_mean_of_renders_on_the_way():
    """Sixteen masters of the board at moments of the exposure, against one master and its motion."""
    camera = CAMERA.replace(lens="equidistance", fx=190.0, fy=190.0)
    R = rotation_from_euler(np.deg2rad([25.0, -20.0, 10.0]))
    pose = Pose(R, np.array([30.0, 20.0, 1200.0]) - R @ TARGET.board_centre)
    rate = PoseRate.about(pose, TARGET.board_centre, np.array([500.0, 200.0, 300.0]), np.array([0.0, 0.5, 1.5]))
    model = SensorModel(exposure_s=0.04)
    moments = (np.arange(16) + 0.5) / 16.0 - 0.5

    def light(at, samples):
        return render_frame(TARGET, Light(), camera, at, samples=samples).full(camera)

    mean = np.mean([light(rate.moved(pose, s * 0.04), 64) for s in moments], axis=0, dtype=np.float64)
    expected = develop(mean.astype(np.float32), SensorModel()).astype(float)
    still = light(pose, 256)
    found = develop(still, model, shot(rate=rate, pose=pose, camera=camera)).astype(float)
    moved, unmoved = (np.sqrt(np.mean((picture - expected) ** 2)) for picture in (found, develop(still, SensorModel())))
    assert unmoved > 5.0  # the motion, 2 to 4 px, is plain to see
    assert moved < 0.6  # two roundings, 0.4; 64 rays; the raised circle, which moves by another way
