"""Lens laws against closed forms and OpenCV."""

import cv2
import numpy as np
import pytest

from eposit import LENS_NAMES, Camera, get_lens
from eposit.calibrated_lens import double_sphere, eucm, kannala_brandt, pinhole_radial
from eposit.lens import LENSES
from tests.cameras import COEFFICIENTS, KB, PINHOLES, paper_camera

# The paper's equations 1 to 5, written again.
RADIUS = {
    "perspective": lambda a: np.sin(a) / np.cos(a),
    "stereographic": lambda a: 2 * np.sin(a / 2) / np.cos(a / 2),
    "equidistance": lambda a: a,
    "equisolid": lambda a: np.sqrt(2 * (1 - np.cos(a))),
    "orthogonal": lambda a: np.sin(a),
}


def law(name):
    return get_lens(name, COEFFICIENTS.get(name, ()))


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
def test_g_is_sine_over_rho_and_finite_on_the_axis(name):
    theta = np.deg2rad(np.linspace(0.1, 80.0, 200))
    np.testing.assert_allclose(law(name).g(theta) * law(name).rho(theta), np.sin(theta), rtol=1e-13)
    paraxial = 0.8 if name == "double_sphere" else 1.0  # 1 + xi
    assert law(name).g(0.0) == pytest.approx(paraxial, abs=1e-15)
    assert law(name).slope(0.0) == pytest.approx(1.0 / paraxial, abs=1e-15)
    # sinc and the cosines are flat at 0: 1 - theta^2 / 2 at 1e-9 is 1 to the last bit.
    np.testing.assert_allclose(law(name).g(1e-9), paraxial, rtol=0, atol=1e-15)


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


@pytest.mark.parametrize("coefficients", [(-0.28, 0.12, 0.02), (0.1, 0.02, 0.0), (-0.3, 0.05, 0.0)])
def test_pinhole_radial_is_opencvs_pinhole_without_tangential_distortion(coefficients):
    camera = paper_camera("perspective").replace(lens="pinhole_radial", coefficients=coefficients)
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (2000, 3)) + [0.0, 0.0, 2.1]
    x, y, z = points.T
    points = points[np.arctan2(np.hypot(x, y), z) < camera.law.theta_max]
    k1, k2, k3 = coefficients
    expected, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), camera.matrix(), np.array([k1, k2, 0, 0, k3]))
    np.testing.assert_allclose(camera.project(points), expected[:, 0], rtol=0, atol=1e-9)
    assert len(points) > 1500


def test_pinhole_radial_stops_where_it_turns_and_is_inverted_far_out():
    turning = pinhole_radial((-0.3, 0.0, 0.0))  # rises while 1 - 0.9 tan^2 > 0
    assert np.tan(turning.theta_max) == pytest.approx(np.sqrt(1.0 / 0.9), rel=1e-12)
    assert np.isnan(turning.theta(turning.rho_max * (1.0 + 1e-12)))
    for coefficients in ((0.0, 0.0, 0.0), (0.5, 0.3, 0.2), (-0.28, 0.12, 0.02), (0.0, 1e-3, 1e-6)):
        lens, theta = pinhole_radial(coefficients), np.deg2rad([0.0, 1.0, 45.0, 80.0, 89.0, 89.99])
        np.testing.assert_allclose(lens.theta(lens.rho(theta)), theta, rtol=0, atol=1e-14)


def test_eucm_is_the_papers_projection():
    """Equation 7: x over alpha d + (1 - alpha) z, d^2 = beta (x^2 + y^2) + z^2; where z > -w d alone."""
    points = np.random.default_rng(3).normal(size=(4000, 3))
    x, y, z = points.T
    for alpha, beta in ((0.6, 1.1), (0.5, 1.0), (0.3, 0.8), (0.0, 2.0), (0.95, 0.7)):
        d = np.sqrt(beta * (x * x + y * y) + z * z)
        w = alpha / (1.0 - alpha) if alpha <= 0.5 else (1.0 - alpha) / alpha
        camera = paper_camera("equisolid").replace(lens="eucm", coefficients=(alpha, beta))
        valid = z > -w * d
        np.testing.assert_array_equal(camera.sees(points), valid)
        scale = 1.0 / (alpha * d + (1.0 - alpha) * z)[valid]
        u, v = camera.fx * x[valid] * scale + camera.cx, camera.fy * y[valid] * scale + camera.cy
        # Next to a pole the scale, and its rounding, grow without bound.
        np.testing.assert_allclose(camera.project(points[valid]), np.stack((u, v), axis=1), rtol=1e-9)


def test_double_sphere_is_the_papers_projection_and_its_rays():
    """Equation 40, and equations 46 to 50 for rays, of which those up to r^2 = 1 / (2 alpha - 1) exist."""
    points = np.random.default_rng(4).normal(size=(4000, 3))
    x, y, z = points.T
    d1 = np.linalg.norm(points, axis=1)
    for xi, alpha in ((-0.2, 0.6), (0.4, 0.3), (0.0, 0.5), (-0.5, 0.8), (0.3, 1.0), (-0.3, 0.0)):
        d2 = np.sqrt(x * x + y * y + (xi * d1 + z) ** 2)
        camera = paper_camera("equisolid").replace(lens="double_sphere", coefficients=(xi, alpha))
        w1 = alpha / (1.0 - alpha) if alpha <= 0.5 else (1.0 - alpha) / alpha
        w2 = (w1 + xi) / np.sqrt(2.0 * w1 * xi + xi**2 + 1.0)
        seen = camera.sees(points)
        if xi >= 0.0:  # the paper's bound is on the safe side there
            assert np.all(seen[z > -w2 * d1])
        scale = 1.0 / (alpha * d2 + (1.0 - alpha) * (xi * d1 + z))[seen]
        u, v = camera.fx * x[seen] * scale + camera.cx, camera.fy * y[seen] * scale + camera.cy
        np.testing.assert_allclose(camera.project(points[seen]), np.stack((u, v), axis=1), rtol=1e-9)
        m = np.random.default_rng(5).uniform(-1.0, 1.0, (1000, 2)) * min(camera.law.rho_max, 3.0)
        r2 = np.sum(m * m, axis=1)
        m, r2 = m[r2 <= camera.law.rho_max**2], r2[r2 <= camera.law.rho_max**2]
        mz = (1.0 - alpha**2 * r2) / (alpha * np.sqrt(1.0 - (2.0 * alpha - 1.0) * r2) + 1.0 - alpha)
        length = (mz * xi + np.sqrt(mz**2 + (1.0 - xi**2) * r2)) / (mz**2 + r2)
        rays = length[:, None] * np.column_stack((m, mz)) - [0.0, 0.0, xi]
        pixels = m * [camera.fx, camera.fy] + [camera.cx, camera.cy]
        np.testing.assert_allclose(camera.bearing(pixels), rays, rtol=0, atol=1e-12)
        np.testing.assert_allclose(camera.project(rays), pixels, rtol=1e-6)  # at the rim the root of rounding


@pytest.mark.parametrize(
    "lens", [eucm((0.6, 1.1)), eucm((0.4, 0.9)), double_sphere((-0.2, 0.6)), double_sphere((0.3, 0.4))]
)
def test_an_image_ends_at_its_turn_or_at_its_pole(lens):
    at_end, inside = lens.raw_slope(np.array(lens.theta_max)), lens.raw_slope(np.linspace(0.0, 0.999 * lens.theta_max))
    assert np.all(inside > 0.0)
    assert abs(at_end) < 1e-7 if lens.includes_max else abs(lens.raw_g(np.array(lens.theta_max))) < 1e-7
    if lens.includes_max:
        assert lens.rho(lens.theta_max) == pytest.approx(lens.rho_max, rel=1e-12)


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
    limit = np.deg2rad(85.0 if name in (*PINHOLES, "orthogonal") else 110.0)
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
    [
        {"lens": "fisheye"},
        {"fx": 0.0},
        {"fy": -1.0},
        {"cx": np.nan},
        {"width": 0},
        {"coefficients": (0.1,)},
        {"lens": "pinhole_radial", "coefficients": (0.1, 0.0)},
        {"lens": "pinhole_radial", "coefficients": (0.0, 1e300, -0.1)},
        {"lens": "eucm", "coefficients": (1.2, 1.0)},
        {"lens": "eucm", "coefficients": (0.5, 0.0)},
        {"lens": "double_sphere", "coefficients": (1.0, 0.5)},
    ],
)
def test_wrong_camera_is_a_sentence(wrong):
    good = {"lens": "equisolid", "fx": 1.0, "fy": 1.0, "cx": 0.0, "cy": 0.0, "width": 2, "height": 2}
    with pytest.raises(ValueError, match=r"\w+ .*(;|must)"):
        Camera(**(good | wrong))


@pytest.mark.filterwarnings("error")
def test_extreme_coefficients_and_radii_warn_of_nothing():
    pinhole_radial((0.0, 0.0, 1e-30)).theta(np.array([0.1, 1e300]))
    for coefficients in ((0.0, 0.0, 1e-320), (1e12, -1e12, 1e12), (-0.1, 0.0, 1e-310)):
        assert np.isfinite(pinhole_radial(coefficients).rho(np.array([0.1]))[0]) or coefficients[0] == 1e12
