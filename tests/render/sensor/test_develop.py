"""The sensor model against closed forms and counted areas."""

import dataclasses

import cv2
import numpy as np
import pytest
from scipy.stats import kstest, norm

from eposit import LENS_NAMES
from render.analytic.image_circle import lens_coverage
from render.sensor.develop import develop
from render.sensor.noise import standard_normals
from render.sensor.optics import disc_kernel, natural_falloff, vignetting_gain
from render.sensor.presets import SensorModel, regime_of, regimes
from tests.cameras import COEFFICIENTS, RADIUS
from tests.render.sensor.frames import BARE, CAMERA, flat, shot


@pytest.mark.parametrize("gamma", [1.0, 2.2])
@pytest.mark.parametrize("sigma", [0.0, 0.7, 1.5])
def test_without_noise_the_bits_are_those_of_blur_and_rounding(sigma, gamma):
    light = np.random.default_rng(1).uniform(0.0, 1.5, (90, 120)).astype(np.float32)
    before = light.copy()
    size = 2 * int(np.ceil(5.0 * sigma)) + 1
    spread = cv2.GaussianBlur(light, (size, size), sigma, borderType=cv2.BORDER_REPLICATE) if sigma else light
    linear = np.clip(spread * np.float32(0.8), 0.0, 1.0)
    expected = np.rint((linear if gamma == 1.0 else linear ** np.float32(1.0 / gamma)) * np.float32(255.0))
    model = SensorModel(psf_sigma_px=sigma, gamma=gamma)
    np.testing.assert_array_equal(develop(light, model), expected.astype(np.uint8))
    np.testing.assert_array_equal(develop(light, model, shot()), expected.astype(np.uint8))
    np.testing.assert_array_equal(light, before)  # the master is developed again and again


@pytest.mark.parametrize("radius", [0.3, 0.5, 0.8, 1.0, 2.3, 5.7])
def test_the_disc_covers_the_area_that_is_counted(radius):
    kernel = disc_kernel(radius)
    n, reach = 201, len(kernel) // 2
    fine = (np.arange(n * len(kernel)) + 0.5) / n - 0.5 - reach
    inside = np.hypot(fine[None], fine[:, None]) <= radius
    counted = inside.reshape(len(kernel), n, len(kernel), n).mean(axis=(1, 3)) / (np.pi * radius**2)
    # A pixel's border of length 1 crosses 201 cells, half of each is counted wrongly at random.
    np.testing.assert_allclose(kernel, counted, atol=1e-3 / radius**2)
    assert kernel.sum() == pytest.approx(1.0, abs=1e-6)
    assert counted.sum() == pytest.approx(1.0, abs=1e-3)  # no part of the disc lies beyond the kernel


def test_corners_lose_light_by_the_cos4_law():
    gain = vignetting_gain(400, 300, 0.4)
    assert gain[0, 0] == gain[-1, -1] == pytest.approx(0.6, abs=1e-6)
    assert gain[149:151, 199:201].min() > 0.9999
    slope = np.sqrt(1.0 / np.sqrt(0.6) - 1.0)  # tangent of the angle to the corner
    for x, y in ((0, 0), (10, 200), (390, 20)):
        radius = np.hypot(x - 199.5, y - 149.5) / np.hypot(199.5, 149.5)
        assert gain[y, x] == pytest.approx(np.cos(np.arctan(slope * radius)) ** 4, abs=1e-6)
    grey = develop(flat(0.5), dataclasses.replace(BARE, vignetting=0.4))
    np.testing.assert_array_equal(grey, np.rint(127.5 * gain).astype(np.uint8))


FALL_OFF = {  # of a flat pupil of fixed size, over the incidence angle, rad
    "perspective": lambda a: np.cos(a) ** 4,
    "stereographic": lambda a: np.cos(a) * np.cos(a / 2) ** 4,
    "equidistance": lambda a: np.cos(a) * np.sin(a) / a,
    "equisolid": np.cos,
    "orthogonal": np.ones_like,
}


def lens_camera(lens):
    """A camera whose corner lies at 75 degrees, of a distorted pinhole at 45; that of an orthogonal lens is dark."""
    corner = np.deg2rad(45.0 if lens == "pinhole_radial" else 75.0)
    f = 249.0 / (0.95 if lens == "orthogonal" else RADIUS[lens](corner))
    k = COEFFICIENTS.get(lens, ())
    return CAMERA.replace(lens=lens, fx=f, fy=1.02 * f, cx=195.3, cy=152.1, coefficients=k)


@pytest.mark.parametrize("lens", FALL_OFF)
def test_the_pupils_fall_off_is_the_lenss_formula(lens):
    camera = lens_camera(lens)
    x, y = np.meshgrid(np.arange(400.0), np.arange(300.0))
    theta = camera.law.theta(np.hypot((x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy))
    seen = np.isfinite(theta)
    # The gain is the mean over the pixel's width: its second derivative, at most 20 / f^2, over 24.
    np.testing.assert_allclose(natural_falloff(camera, 1.0)[seen], FALL_OFF[lens](theta[seen]), rtol=0, atol=2e-4)
    half, whole = (natural_falloff(camera, share) for share in (0.5, 1.0))
    np.testing.assert_allclose(half, np.sqrt(whole), rtol=0, atol=1e-6, equal_nan=False)


@pytest.mark.parametrize("lens", LENS_NAMES)
def test_the_pupils_fall_off_is_the_solid_angle_of_a_pixel_times_its_cosine(lens):
    camera, n = lens_camera(lens), 40
    sub = (np.arange(n) + 0.5) / n - 0.5
    middle = None
    for pixel in ((195, 152), (60, 152), (195, 20), (330, 250), (120, 90)):
        x, y = np.meshgrid(pixel[0] + sub, pixel[1] + sub)
        ray, right, down = (
            camera.bearing(np.stack((x + dx, y + dy), axis=-1)) for dx, dy in ((0, 0), (1e-3, 0), (0, 1e-3))
        )
        solid_angle = np.linalg.norm(np.cross(right - ray, down - ray), axis=-1) * 1e6
        light = np.mean(solid_angle * ray[..., 2])
        middle = light if middle is None else middle
        # The forward difference of 1e-3 px is as wrong as 1e-3 / f; the first pixel lies 0.3 px off the axis.
        assert natural_falloff(camera, 1.0)[pixel[1], pixel[0]] == pytest.approx(light / middle, abs=2e-4)


def test_a_flat_pupil_lets_nothing_through_past_90_degrees_and_blurs_no_picture():
    wide = CAMERA.replace(lens="equidistance", fx=120.0, fy=120.0)
    gain = natural_falloff(wide, 1.0)
    assert gain[149, 10] == 0.0  # 1.57 rad are 188.5 px
    assert gain[149, 12] > 0.0
    grey = develop(flat(0.5), dataclasses.replace(BARE, natural_falloff=1.0), shot(camera=wide))
    np.testing.assert_array_equal(grey, np.rint(np.float32(127.5) * gain).astype(np.uint8))


def test_fall_off_is_finite_where_the_polynomial_turns():
    camera = CAMERA.replace(lens="kannala_brandt", fx=250.0, fy=250.0, coefficients=(-0.25, 0.0, 0.0, 0.0))
    gain = natural_falloff(camera, 1.0)
    assert np.all(np.isfinite(gain))
    light = gain * lens_coverage(camera)
    assert 1.0 < light.max() < 20.0  # a ring of rays falls on a pixel at the turn; a slice of one at the rim gets more


def test_uneven_light_is_a_plane_in_a_direction_of_the_frame():
    model = dataclasses.replace(BARE, uneven=0.3)
    x, y = np.meshgrid(np.arange(400) - 199.5, np.arange(300) - 149.5)
    corner, directions = np.hypot(199.5, 149.5), []
    for seed in range(3):
        grey = develop(flat(0.5), model, shot(seed)).astype(float)
        (a, b, c), *_ = np.linalg.lstsq(
            np.stack((x.ravel(), y.ravel(), np.ones(x.size)), axis=1), grey.ravel(), rcond=None
        )
        assert np.abs(grey - a * x - b * y - c).max() <= 0.51  # rounding is half a grey level
        assert c == pytest.approx(127.5, abs=0.01)
        assert np.hypot(a, b) * corner == pytest.approx(0.3 * 127.5, rel=1e-3)
        directions.append(np.arctan2(b, a))
    assert len(set(np.round(directions, 3))) == 3


@pytest.mark.parametrize("signal", [0.0, 0.1, 0.5, 0.9])
def test_noise_has_the_mean_and_variance_of_electrons(signal):
    model = dataclasses.replace(BARE, full_well_e=2000.0, read_noise_e=20.0)
    grey = develop(flat(signal), model, shot(3)).astype(float)
    variance = 255.0**2 * (signal * 2000.0 + 400.0) / 2000.0**2 + 1.0 / 12.0  # rounding adds a twelfth
    n = grey.size
    if signal == 0.0:  # the negative half is clipped: of deviation s the mean is s / sqrt(2 pi)
        expected = np.sqrt(variance / (2.0 * np.pi))
        assert grey.mean() == pytest.approx(expected, abs=0.03)  # rounding at the clip moves 0.02
        return
    assert grey.mean() == pytest.approx(255.0 * signal, abs=4.0 * np.sqrt(variance / n))  # four standard errors
    assert grey.var() == pytest.approx(variance, rel=4.0 * np.sqrt(2.0 / n))
    # Neighbours have nothing to do with each other: a correlation of n pixels has standard error n^-1/2.
    rest = (grey - grey.mean()) / grey.std()
    assert abs(np.mean(rest[:, 1:] * rest[:, :-1])) < 4.0 / np.sqrt(n)
    assert abs(np.mean(rest[1:] * rest[:-1])) < 4.0 / np.sqrt(n)


def test_the_noise_is_gaussian():
    z = standard_normals(1_000_003, np.random.SFC64(5))
    assert z.dtype == np.float32
    assert len(z) == 1_000_003
    assert kstest(z, norm.cdf).pvalue > 0.01
    assert abs(np.mean(z**4) - 3.0) < 4.0 * np.sqrt(96.0 / len(z))  # the fourth power has variance 96


def test_the_seed_decides_the_noise_everywhere():
    model = regimes()["typical"]
    first, again, other = (develop(flat(0.5), model, shot(seed)) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    blocks = (first != other).reshape(10, 30, 10, 40).mean(axis=(1, 3))
    assert blocks.min() > 0.5


def test_frames_are_asked_for_where_they_matter():
    for change in ({"full_well_e": 100.0}, {"uneven": 0.1}, {"exposure_s": 0.1}, {"natural_falloff": 1.0}):
        with pytest.raises(ValueError, match="give the frame"):
            develop(flat(0.5), dataclasses.replace(BARE, **change))


def test_regimes_have_names_and_harsh_is_worse_than_typical():
    named = regimes()
    assert list(named) == ["clean", "typical", "paper", "harsh"]
    assert named["clean"] == SensorModel()
    assert [regime_of(model) for model in named.values()] == list(named)
    assert regime_of(dataclasses.replace(named["harsh"], gamma=2.0)) is None
    typical, harsh = named["typical"], named["harsh"]
    for name in ("psf_sigma_px", "defocus_radius_px", "exposure_s", "vignetting", "uneven", "read_noise_e"):
        assert getattr(harsh, name) > getattr(typical, name)
    assert harsh.full_well_e < typical.full_well_e
