"""Bright dots through every lens: the renderer's projection against closed forms that it does not share.

The truth is the centroid of each dot's outline, projected by the formulas below, not by `eposit`. Renderer and solver
share the lens law in spirit; a mistake in both would cancel, and this is where it shows.
"""

import numpy as np
import pytest

from eposit import LENS_NAMES, Camera, Pose
from pipelines.stages.generate import outline_centroid
from render import backend
from render.pathtraced.fisheye import sensor_dict
from render.targets.image_region import Region
from tests.cameras import COEFFICIENTS, RADIUS

WIDTH, HEIGHT, SAMPLES = 800, 600, 64
DIRECTIONS, DOT_PX, DISTANCE_MM = 12, 4.0, 1000.0
CENTRE = (403.3, 296.8)
RINGS_DEG = {"perspective": (30.0, 70.0), "pinhole_radial": (12.0, 45.0)}
FISHEYE_RINGS_DEG = (12.0, 80.0)
MEAN_PX, DOT_RMS_PX = 0.005, 0.02
# test_fisheye.py compares the rays of every lens with the library's, whose laws tests/eposit/test_lens.py compares with
# closed forms.
QUICK = ("perspective", "equisolid")
IN_TIERS = [lens if lens in QUICK else pytest.param(lens, marks=pytest.mark.full) for lens in LENS_NAMES]


def camera_for(lens):
    """The focal length that puts the outermost ring, and its dots, just inside the picture."""
    f = 280.0 / RADIUS[lens](np.deg2rad(RINGS_DEG.get(lens, FISHEYE_RINGS_DEG)[1]))
    coefficients = COEFFICIENTS.get(lens, ())
    return Camera(
        lens=lens, fx=f, fy=1.001 * f, cx=CENTRE[0], cy=CENTRE[1], width=WIDTH, height=HEIGHT, coefficients=coefficients
    )


def project(camera, points, scale=1.0, shift=0.0):
    """(n, 3) to (n, 2) px by the closed forms, with a law scaled or a principal point shifted to be caught."""
    side = np.hypot(points[:, 0], points[:, 1])
    radius = scale * RADIUS[camera.lens](np.arctan2(side, points[:, 2]))
    return np.stack(
        (
            camera.fx * radius * points[:, 0] / side + camera.cx + shift,
            camera.fy * radius * points[:, 1] / side + camera.cy,
        ),
        axis=1,
    )


def dots(camera):
    """Rings x directions of discs that face the camera: centre, two axes as long as the radius."""
    # The inner ring is wide enough that its dots do not touch.
    rings = np.deg2rad(np.linspace(*RINGS_DEG.get(camera.lens, FISHEYE_RINGS_DEG), 6))
    found = []
    for i, theta in enumerate(rings):
        step = 1e-5
        radial = camera.fx * (RADIUS[camera.lens](theta + step) - RADIUS[camera.lens](theta - step)) / (2 * step)
        tangential = camera.fx * RADIUS[camera.lens](theta) / np.sin(theta)
        radius = DISTANCE_MM * np.tan(DOT_PX / np.sqrt(radial * tangential))
        for k in range(DIRECTIONS):
            phi = (
                2 * np.pi * (k + 0.37 * i) / DIRECTIONS
            )  # turned from ring to ring, so that no ring meets the pixels alike
            direction = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
            along = np.array([np.cos(theta) * np.cos(phi), np.cos(theta) * np.sin(phi), -np.sin(theta)])
            found.append((i, phi, DISTANCE_MM * direction, radius * along, radius * np.cross(direction, along)))
    return found


def render_dots(camera):
    """(height, width) coverage of the picture by the dots, through Mitsuba's own direct integrator and our sensor."""
    mi = backend.load()
    scene = {"type": "scene", "integrator": {"type": "direct"}}
    for i, (_, _, centre, a, b) in enumerate(dots(camera)):
        normal = -centre / np.linalg.norm(centre)
        frame = np.eye(4)
        frame[:3] = np.column_stack((a, np.cross(normal, a), normal, centre))
        scene[f"dot{i}"] = {
            "type": "disk",
            "to_world": mi.ScalarTransform4f(frame),
            "emitter": {"type": "area", "radiance": {"type": "uniform", "value": 1.0}},
        }
        assert abs(np.linalg.norm(a) - np.linalg.norm(b)) < 1e-9
    pose = Pose(np.eye(3), np.zeros(3))
    sensor = mi.load_dict(sensor_dict(camera, pose, Region.whole(WIDTH, HEIGHT), SAMPLES))
    return np.array(mi.render(mi.load_dict(scene), sensor=sensor, spp=SAMPLES, seed=3))[..., 0]


def offsets(camera, picture, **wrong):
    """(rings, directions, 2) measured centroid minus truth, along the radius and across it, px."""
    angle = np.linspace(0.0, 2 * np.pi, 720, endpoint=False)
    rows = []
    for _, phi, centre, a, b in dots(camera):
        outline = project(camera, centre + np.cos(angle)[:, None] * a + np.sin(angle)[:, None] * b, **wrong)
        truth = outline_centroid(outline)
        x0, y0 = np.floor(outline.min(axis=0)).astype(int) - 2
        x1, y1 = np.ceil(outline.max(axis=0)).astype(int) + 3
        part = picture[y0:y1, x0:x1]
        assert part.max() > 0.99  # the dot is there, whole
        measured = np.array([part.sum(0) @ np.arange(x0, x1), part.sum(1) @ np.arange(y0, y1)]) / part.sum()
        turn = np.array([[np.cos(phi), np.sin(phi)], [-np.sin(phi), np.cos(phi)]])
        rows.append((measured - truth, turn @ (measured - truth)))
    return np.array(rows).reshape(6, DIRECTIONS, 2, 2)


def faults(found):
    """What of the three bounds does not hold."""
    plain, polar = found[:, :, 0], found[:, :, 1]
    broken = []
    if np.abs(plain.mean(axis=(0, 1))).max() >= MEAN_PX:
        broken.append("signed mean")
    if np.abs(polar.mean(axis=1)).max() >= MEAN_PX:
        broken.append("ring mean")
    if np.sqrt(np.mean(plain**2, axis=(0, 1))).max() >= DOT_RMS_PX:
        broken.append("dot")
    return broken


@pytest.mark.parametrize("lens", IN_TIERS)
def test_dots_lie_where_the_closed_form_puts_them(lens):
    camera = camera_for(lens)
    picture = render_dots(camera)
    assert faults(offsets(camera, picture)) == []
    # The bounds are tight enough to notice a law wrong by 0.02 % and a shift of 0.02 px.
    assert faults(offsets(camera, picture, scale=1.0002))
    assert faults(offsets(camera, picture, scale=0.9998))
    assert faults(offsets(camera, picture, shift=0.02))
    assert faults(offsets(camera, picture, shift=-0.02))
