"""The pixels' bound against numeric derivatives, and against the closed form for straight edges."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from eposit import Camera, Pose
from eposit.pose import rotation_from_vector
from pipelines.photometric.normal_equations import symmetric
from pipelines.photometric.picture import PictureModel, Shape
from pipelines.photometric.pixel_bound import pixel_bound, true_sums
from render.frame import render_frame
from render.light import Light
from render.sensor.presets import SensorModel
from tests.pipelines.photometric.small import NOISY, TARGET, small

STEPS = np.array([2e-5, 2e-5, 2e-5, 0.03, 0.03, 0.1])  # rad and mm: a hundredth of a pixel


def information(case, sensor):
    """(6, 6) of the pose with all else known, and the model."""
    model = PictureModel.around(
        TARGET, case.frame.camera, Shape(case.frame.cam_from_obj, sensor.psf_sigma_px), circle=True
    )
    return symmetric(true_sums(model, case.linear, sensor, case.frame).shape.sum(axis=0))[:6, :6], model


def test_information_is_that_of_numeric_derivatives():
    sensor = SensorModel(psf_sigma_px=0.8, full_well_e=2000.0, read_noise_e=3.0, exposure=0.7)
    case = small()
    found, model = information(case, sensor)
    pose, camera = case.frame.cam_from_obj, case.frame.camera

    def expected(step):
        moved = Pose(rotation_from_vector(step[:3]) @ pose.R, pose.t + step[3:])
        linear = render_frame(TARGET, Light(), camera, moved, samples=64, region=case.linear.region)
        grey = cv2.GaussianBlur(linear.full(camera), (11, 11), 0.8) * (255.0 * 0.7)
        return grey[model.region.pixels].ravel()[model.used].astype(np.float64)

    slopes = np.stack([(expected(h) - expected(-h)) / (2.0 * h.max()) for h in np.diag(STEPS)], axis=1)
    grey = expected(np.zeros(6))
    variance = 1.0 / 12.0 + (grey / 255.0 * 2000.0 + 9.0) * (255.0 / 2000.0) ** 2
    weight = 1.0 / variance + 0.5 * (255.0 / 2000.0 / variance) ** 2
    numeric = slopes.T @ (slopes * weight[:, None])
    scale = np.sqrt(np.diag(numeric))
    # The flow of pixels on the raised circle's rim and of the light's map is that of the planes: within two percent.
    assert np.abs((found - numeric) / np.outer(scale, scale)).max() < 0.03


def test_information_on_a_shift_is_that_of_straight_edges():
    """A blurred edge of contrast A and total width s has A^2 / (2 sqrt(pi) s v) per px of its length, v the noise.

    Where the lines of a chessboard cross, the integral of 1 - erf^2 along an edge takes 4 s / sqrt(pi) from its length,
    where an edge ends at a corner a quarter of that.
    """
    camera = Camera(lens="perspective", fx=300.0, fy=300.0, cx=200.0, cy=150.0, width=400, height=300)
    light = Light(lamp_position_mm=(400.0, 250.0, -1e5), lamp_side_mm=900.0, ambient_share=0.0)
    case = small(camera, angles=(0.0, 0.0, 0.0), centre=(1.3, -0.7, 1503.0), light=light)
    sigma, white = 1.2, 255.0 * 0.8
    found, _ = information(case, SensorModel(psf_sigma_px=sigma, exposure=0.8))  # rounding alone: v = 1 / 12
    scale, width = 300.0 / 1503.0, np.sqrt(sigma**2 + 1.0 / 12.0)  # px per mm; with the pixel's own box
    crossing, end = 4.0 * width / np.sqrt(np.pi), width / np.sqrt(np.pi)
    lines = scale * 9 * 700.0 - 54 * crossing - 18 * end + scale * 700.0 - 14 * end
    outline = scale * 2 * 900.0 - 4 * end
    circle = scale * np.pi * TARGET.circle_radius_mm  # of its rim cos^2 counts
    contrasts = 1.0 - TARGET.black / TARGET.white, 1.0 - Light().background, 1.0 - TARGET.circle / TARGET.white
    total = sum(length * (white * c) ** 2 for length, c in zip((lines, outline, circle), contrasts, strict=True))
    # The circle's shadow takes a little of its contrast.
    assert found[3, 3] == pytest.approx(scale**2 * total / (2.0 * np.sqrt(np.pi) * width / 12.0), rel=0.02)


def test_noise_and_darkness_raise_the_bound():
    case = small()
    clear, dim = (
        pixel_bound(case.linear, NOISY, case.frame),
        pixel_bound(case.linear, replace(NOISY, full_well_e=600.0), case.frame),
    )
    assert np.all(np.diag(dim) > 4.0 * np.diag(clear))
