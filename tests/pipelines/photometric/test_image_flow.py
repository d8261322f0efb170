"""Derivatives of images with respect to places and poses, against numeric ones, for every lens."""

import numpy as np
import pytest

from eposit import LENS_NAMES, Camera, Pose
from eposit.pose import rotation_from_vector
from pipelines.photometric.image_flow import image_flow, plane_points, projection_slopes
from render.targets.image_region import Region
from tests.cameras import COEFFICIENTS
from tests.pipelines.photometric.small import FISHEYE, small

POINTS = np.array([[0.3, -0.2, 1.0], [-0.9, 0.4, 0.8], [0.0, 0.0, 2.0], [0.1, 0.5, 0.6]]) * 1000.0
STEP = 1e-3  # mm, of points a metre away: truncation and rounding are both some 1e-9


@pytest.mark.parametrize("lens", LENS_NAMES)
def test_slopes_of_the_projection(lens):
    camera = FISHEYE.replace(lens=lens, coefficients=COEFFICIENTS.get(lens, ()))
    found = projection_slopes(camera, POINTS.T)
    for axis, step in enumerate(STEP * np.eye(3)):
        numeric = (camera.project(POINTS + step) - camera.project(POINTS - step)) / (2.0 * STEP)
        assert np.allclose(found[:, axis].T, numeric, atol=1e-7)


def test_flow_of_a_change_of_pose():
    pose = small().frame.cam_from_obj
    points = np.array([[0.0, 0.0, 0.0], [800.0, 500.0, 0.0], [-50.0, 50.0, -10.0]])
    found = image_flow(FISHEYE, pose, points)
    for k, size in enumerate((1e-6, 1e-6, 1e-6, 1e-3, 1e-3, 1e-3)):
        step = size * np.eye(6)[k]
        moved = [Pose(rotation_from_vector(s * step[:3]) @ pose.R, pose.t + s * step[3:]) for s in (1.0, -1.0)]
        numeric = np.subtract(*(FISHEYE.project(other.apply(points)) for other in moved)) / (2.0 * size)
        assert np.allclose(found[:, k].T, numeric, rtol=1e-6, atol=1e-6)


def test_pixels_look_at_the_points_whose_images_they_are():
    pose, region = small().frame.cam_from_obj, Region(150, 120, 40, 30)
    points, met = plane_points(FISHEYE, pose, region, z=-10.0)
    assert np.all(met)
    y, x = np.mgrid[120:150, 150:190]
    assert np.allclose(FISHEYE.project(pose.apply(points)), np.column_stack((x.ravel(), y.ravel())), atol=1e-9)


def test_a_ray_away_from_the_plane_meets_nothing():
    camera = Camera(lens="equidistance", fx=60.0, fy=60.0, cx=100.0, cy=75.0, width=200, height=150)
    pose = Pose(np.eye(3), np.array([0.0, 0.0, 1000.0]))
    points, met = plane_points(camera, pose, Region.whole(200, 150))
    assert 0 < np.sum(met) < met.size  # the picture reaches beyond 90 degrees
    assert np.all(points[~met] == 0.0)
