"""Lens laws against closed forms and OpenCV."""

import cv2
import numpy as np
import pytest

from eposit import LENS_NAMES, Camera, get_lens
from eposit.lens import LENSES, kannala_brandt
from tests.cameras import KB, paper_camera

# The paper's equations 1 to 5, written again.
RADIUS = {
    "perspective": lambda a: np.sin(a) / np.cos(a),
    "stereographic": lambda a: 2 * np.sin(a / 2) / np.cos(a / 2),
    "equidistance": lambda a: a,
    "equisolid": lambda a: np.sqrt(2 * (1 - np.cos(a))),
    "orthogonal": lambda a: np.sin(a),
}


def law(name):
    return get_lens(name, KB if name == "kannala_brandt" else ())


@pytest.mark.parametrize("name", RADIUS)
def test_rho_is_the_papers_equation(name):
    theta = np.deg2rad(np.linspace(1.0, 85.0, 200))
    # sqrt(2 (1 - cos)) at 1 degree loses 4 digits: 1e-16 / 1.5e-4.
    np.testing.assert_allclose(LENSES[name].rho(theta), RADIUS[name](theta), rtol=1e-12)


@pytest.mark.parametrize("name", LENS_NAMES)
def test_theta_inverts_rho(name):
    theta = np.deg2rad(np.linspace(0.0, 80.0, 1001))
    # Worst is arcsin near 90 degrees: the error grows as eps tan(theta), 1.3e-15 here. Eight times that.
    np.testing.assert_allclose(law(name).theta(law(name).rho(theta)), theta, rtol=0, atol=1e-14)


@pytest.mark.parametrize("name", LENS_NAMES)
def test_g_is_sine_over_rho_and_one_on_the_axis(name):
    theta = np.deg2rad(np.linspace(0.1, 80.0, 200))
    np.testing.assert_allclose(law(name).g(theta) * law(name).rho(theta), np.sin(theta), rtol=1e-13)
    assert law(name).g(0.0) == 1.0
    # sinc and the cosines are flat at 0: 1 - theta^2 / 2 at 1e-9 is 1 to the last bit.
    np.testing.assert_allclose(law(name).g(1e-9), 1.0, rtol=0, atol=1e-15)


@pytest.mark.parametrize("name", LENS_NAMES)
def test_slope_is_the_derivative(name):
    theta = np.deg2rad(np.linspace(1.0, 80.0, 50))
    step = 1e-6
    numeric = (law(name).rho(theta + step) - law(name).rho(theta - step)) / (2 * step)
    # Central difference: truncation step^2 rho''' / 6 (1e-9 at 80 degrees, tan), rounding eps / step = 2e-10.
    np.testing.assert_allclose(law(name).slope(theta), numeric, rtol=1e-7)


@pytest.mark.parametrize("name", LENS_NAMES)
def test_nothing_beyond_theta_max(name):
    lens = law(name)
    assert np.isnan(lens.rho(lens.theta_max + 1e-9))
    assert np.isnan(lens.rho(-1e-9))
    if np.isfinite(lens.rho_max):
        assert np.isnan(lens.theta(lens.rho_max * (1 + 1e-12)))
    for value in (lens.rho(np.nan), lens.theta(np.nan), lens.theta(-1.0)):
        assert np.isnan(value)


def test_the_rims():
    assert LENSES["orthogonal"].rho(np.pi / 2) == 1.0  # the rim itself is seen
    assert np.isnan(LENSES["perspective"].rho(np.pi / 2))
    np.testing.assert_allclose(LENSES["equisolid"].theta(2.0 * np.sin(np.deg2rad(89.0))), np.deg2rad(178.0), atol=1e-13)


def test_kannala_brandt_stops_where_it_turns():
    lens = kannala_brandt((-0.2, 0.0, 0.0, 0.0))  # rises while 1 - 0.6 theta^2 > 0
    assert lens.theta_max == pytest.approx(np.sqrt(1 / 0.6), rel=1e-12)
    theta = lens.theta_max * np.array([0.5, 0.99, 0.9999])
    # Next to the turn the slope vanishes: theta is only as good as sqrt(eps) there, 1e-8 / sqrt(1 - share).
    np.testing.assert_allclose(lens.theta(lens.rho(theta)), theta, rtol=0, atol=1e-11)


@pytest.mark.parametrize(("lens", "coefficients"), [("equidistance", (0, 0, 0, 0)), ("kannala_brandt", KB)])
def test_agrees_with_opencv_fisheye(lens, coefficients):
    camera = paper_camera(lens)
    rng = np.random.default_rng(1)
    points = rng.uniform(-1.0, 1.0, (2000, 3)) + [0.0, 0.0, 1.05]
    points = points[points[:, 2] > 0.2]
    expected, _ = cv2.fisheye.projectPoints(
        points[:, None], np.zeros(3), np.zeros(3), camera.matrix(), np.array(coefficients, float)
    )
    np.testing.assert_allclose(camera.project(points), expected[:, 0], rtol=0, atol=1e-9)


def test_perspective_is_opencv_pinhole():
    camera = paper_camera("perspective")
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (2000, 3)) + [0.0, 0.0, 2.0]
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix(), np.zeros(4))
    np.testing.assert_allclose(camera.project(points), expected[:, 0], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", LENS_NAMES)
def test_bearing_inverts_projection(name):
    camera = paper_camera(name)
    rng = np.random.default_rng(2)
    directions = rng.normal(size=(3000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    limit = np.deg2rad(85.0 if name in ("perspective", "orthogonal") else 110.0)
    directions = directions[np.arccos(directions[:, 2]) < limit]
    # 1000 px hold 1e-13 px of rounding, 2e-16 rad of it; at 85 degrees arcsin multiplies by 11, tan by 1 / 132 the
    # other way round. A hundred times that.
    np.testing.assert_allclose(camera.bearing(camera.project(directions)), directions, rtol=0, atol=5e-13)


@pytest.mark.parametrize("name", LENS_NAMES)
def test_axis_centre_and_backward(name):
    camera = paper_camera(name)
    on_axis, centre, backward = np.eye(3)[2] * 5.0, np.zeros(3), np.array([0.0, 0.0, -1.0])
    np.testing.assert_array_equal(camera.project(on_axis), [camera.cx, camera.cy])
    np.testing.assert_array_equal(camera.bearing([camera.cx, camera.cy]), [0.0, 0.0, 1.0])
    assert np.isnan(camera.project(np.stack((centre, backward)))).all()
    assert list(camera.sees(np.stack((on_axis, centre, backward)))) == [True, False, False]


@pytest.mark.parametrize(
    "wrong",
    [{"lens": "fisheye"}, {"fx": 0.0}, {"fy": -1.0}, {"cx": np.nan}, {"width": 0}, {"coefficients": (0.1,)}],
)
def test_wrong_camera_is_a_sentence(wrong):
    good = {"lens": "equisolid", "fx": 1.0, "fy": 1.0, "cx": 0.0, "cy": 0.0, "width": 2, "height": 2}
    with pytest.raises(ValueError, match=r"\w+ .*(;|must)"):
        Camera(**(good | wrong))
