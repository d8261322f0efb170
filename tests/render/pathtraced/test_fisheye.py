"""The sensor's rays against the library's bearings, to the rim of the image circle."""

from __future__ import annotations

import numpy as np
import pytest

from eposit import LENS_NAMES, Camera, Pose
from eposit.pose import rotation_from_euler
from render import backend
from render.pathtraced.fisheye import tile_sensor
from render.targets.image_region import Region
from tests.cameras import COEFFICIENTS

# Of each lens: to the image circle, or to 178 degrees where the picture goes on.
WIDEST_DEG = {
    "perspective": 80.0,
    "pinhole_radial": 80.0,
    "stereographic": 178.0,
    "equidistance": 178.0,
    "equisolid": 178.0,
    "orthogonal": 89.9,
}


@pytest.mark.parametrize("lens", LENS_NAMES)
def test_rays_are_bearings_to_the_rim(lens):
    coefficients = COEFFICIENTS.get(lens, ())
    camera = Camera(lens=lens, fx=100.0, fy=101.0, cx=63.2, cy=58.9, width=128, height=128, coefficients=coefficients)
    widest = np.deg2rad(WIDEST_DEG.get(lens, np.rad2deg(camera.law.theta_max) - 0.1))
    theta, phi = np.meshgrid(np.linspace(1e-4, widest, 200), np.linspace(0.0, 2.0 * np.pi, 12, endpoint=False))
    bearing = np.stack((np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)), axis=-1).reshape(
        -1, 3
    )
    pixels = camera.project(bearing)
    assert np.isfinite(pixels).all()
    np.testing.assert_allclose(camera.bearing(pixels), bearing, atol=2e-6)  # there and back
    pose = Pose(rotation_from_euler(np.deg2rad([20.0, -30.0, 40.0])), np.array([100.0, 200.0, 300.0]))
    mi = backend.load()
    tile = Region(0, 0, 128, 128)
    sensor = tile_sensor(camera, pose, tile, 1, np.eye(4))
    place = ((pixels + 0.5) / 128.0).T.astype(np.float32)  # Mitsuba's film from 0 to 1
    ray, weight = sensor.sample_ray(0.0, 0.0, mi.Point2f(*place), mi.Point2f(0.0))
    found = np.array(ray.d).T @ pose.R.T
    # A float32 position is good to 1e-5 px far out, which is 1e-7 rad; towards 180 degrees an equisolid lens shows that
    # times 60, and at a rim where the radius turns an error of the radius becomes its square root.
    limit = 2e-3 if lens in ("orthogonal", "eucm", "double_sphere") else 2e-5
    assert np.abs(found - bearing).max() < limit
    assert np.array(weight).min() == 1.0
