"""The released code's behaviour: it gives the paper's figures, which the paper's equations do not, and its defects."""

import numpy as np
import pytest
from scipy.optimize import fsolve

import eposit
from eposit import Pose, released
from eposit.pose import euler_error_rad
from tests.cameras import PAPER_OBJECT, helix_pose, paper_camera

FISHEYES = ("stereographic", "equidistance", "equisolid", "orthogonal")
CENTRE = (800.0, 600.0)
HELIX = [helix_pose(t) for t in range(361)]
TRUTH = Pose(np.stack([pose.R for pose in HELIX]), np.stack([pose.t for pose in HELIX]))


def components(solver, lens, theta_centre):
    """(361, 6) errors on the paper's helix without noise, nominal f: rx, ry, rz in degrees, x, y, z in mm."""
    true = paper_camera(lens)
    f = 1353.0 if lens == "perspective" else 541.0
    nominal = true.replace(fx=f, fy=f)
    found = solver(PAPER_OBJECT, true.project(TRUTH.apply(PAPER_OBJECT)), nominal, theta_centre=theta_centre)
    assert set(found.status) == {"ok"}
    rotation = np.degrees(euler_error_rad(found.cam_from_obj.R, TRUTH.R))
    return np.hstack((rotation, found.cam_from_obj.t - TRUTH.t))


def equations(*args, **options):
    return eposit.solve(*args, "eposit", **options)


# z of the fish-eyes and the pinhole; largest differences of the fish-eyes' means in rotation, x and y, z; image centre
# against principal point: mean rotation, largest x and y, mean z. Of the released program itself, run with 0.4 px of
# noise, and of the paper's equations with the same noise. The paper states 50; .01, .02, 6; below .3, 1.9, 1.9.
FIGURES = [
    (released.solve, -49.6, -39.4, (0.007, 0.008, 5.1), (0.089, 1.28, 6.8)),
    (equations, -42.5, -39.4, (0.002, 0.009, 0.31), (0.062, 0.30, 3.5)),
]


@pytest.mark.parametrize(("solver", "fisheye_z", "pinhole_z", "agreement", "centring"), FIGURES)
def test_the_papers_figures(solver, fisheye_z, pinhole_z, agreement, centring):
    means = np.stack([components(solver, lens, None).mean(axis=0) for lens in FISHEYES])
    # Noise of 13 mm in z over 361 frames moves a mean by 0.7 mm; two draws apart, none here.
    assert means[:, 5].mean() == pytest.approx(fisheye_z, abs=0.7)
    assert components(solver, "perspective", None)[:, 5].mean() == pytest.approx(pinhole_z, abs=0.7)
    # The fish-eyes share their noise, so these hardly depend on it: last printed digit.
    spread = np.ptp(means, axis=0)
    measured = spread[:3].max(), spread[3:5].max(), spread[5]
    np.testing.assert_allclose(measured, agreement, atol=0.0006, rtol=0.01)
    moved = components(solver, "orthogonal", CENTRE) - components(solver, "orthogonal", None)
    measured = np.abs(moved.mean(axis=0))[:3].max(), np.abs(moved[:, 3:5]).max(), abs(moved[:, 5].mean())
    # The largest of 361 frames grows by some per cent with noise.
    np.testing.assert_allclose(measured, centring, rtol=0.05)


def test_the_scale_takes_the_ratio_of_m0_twice():
    """A small object at theta along x, orthogonal lens, so that G0 = cos(theta) and J = j / Z0.

    I Z0 = a i + c k with two scalars. The tilted and overlong k' = (a k - c i) / (|I| Z0 G0^2) over the short depth
    Z0 G0^2 / m, m the mean length of I Z0 and J Z0, gives relative depths that must reproduce a and c.
    """
    camera, theta = paper_camera("orthogonal").replace(fx=550.0, fy=550.0), np.deg2rad(30.0)
    g0, tan = np.cos(theta), np.tan(theta)

    def excess(unknown):
        a, c = unknown
        m = 0.5 * (np.hypot(a, c) + 1.0)
        gain = m / g0**4 / np.hypot(a, c)
        return 1.0 - tan * c * gain - a, tan * (a * gain - 1.0) - c

    a, c = fsolve(excess, (1.0, 0.0), xtol=1e-13)
    m = 0.5 * (np.hypot(a, c) + 1.0)
    points = PAPER_OBJECT * 1e-4
    pose = Pose(np.eye(3), 2000.0 * np.array([np.sin(theta), 0.0, np.cos(theta)]))
    # It moves by rounding only after some 60 steps: pixels carry 1e-16 of themselves, the object 1e-5.
    found = released.solve(points, camera.project(pose.apply(points)), camera, max_iterations=500).cam_from_obj
    # The object's size over its distance, 1e-5, is what the closed form leaves out.
    np.testing.assert_allclose(found.t[[0, 2]] / pose.t[[0, 2]], g0**2 / m, rtol=3e-5)
    np.testing.assert_allclose(found.R @ found.R.T, np.eye(3), atol=1e-12)


def test_its_failures_are_statuses():
    equidistance, pinhole = paper_camera("equidistance"), paper_camera("perspective")
    pose = Pose(np.eye(3), np.array([0.0, 0.0, 2000.0]))  # M0 on the axis: sin(theta) / theta is 0 / 0
    on_axis = equidistance.project(pose.apply(PAPER_OBJECT))
    on_axis[0] = equidistance.cx, equidistance.cy
    assert released.solve(PAPER_OBJECT, on_axis, equidistance).status == "not_converged"
    # theta = asin(r / f) has no value where the pinhole's r exceeds f, beyond 45 degrees.
    for angle, status in ((43.0, "ok"), (47.0, "outside_lens")):
        x = 2000.0 * np.tan(np.deg2rad(angle))
        pixels = pinhole.project(Pose(np.eye(3), np.array([x, 0.0, 2000.0])).apply(0.1 * PAPER_OBJECT))
        solution = released.solve(0.1 * PAPER_OBJECT, pixels, pinhole)
        assert solution.status == status
        assert np.isnan(solution.cam_from_obj.t).all() == (status != "ok")
        assert eposit.solve(0.1 * PAPER_OBJECT, pixels, pinhole).status == "ok"
    assert released.solve(PAPER_OBJECT, on_axis * np.nan, pinhole).status == "non_finite"


def test_it_has_no_flag_for_convergence_and_no_residual():
    camera, pose = paper_camera("orthogonal"), HELIX[0]
    pixels = camera.project(pose.apply(PAPER_OBJECT))
    one, all_steps = (released.solve(PAPER_OBJECT, pixels, camera, max_iterations=n) for n in (1, 50_000))
    assert (one.status, one.iterations) == ("ok", 1)
    assert 5 < all_steps.iterations < 30
    assert np.linalg.norm(one.cam_from_obj.t - all_steps.cam_from_obj.t) > 1.0
    assert np.isnan(all_steps.reprojection_rmse_px)
    assert np.isnan(all_steps.covariance).all()


def test_a_batch_equals_single_calls_and_a_moved_frame():
    camera = paper_camera("equisolid")
    pixels = camera.project(TRUTH.apply(PAPER_OBJECT))[::40]
    batch = released.solve(PAPER_OBJECT, pixels, camera, theta_centre=CENTRE)
    for i, image in enumerate(pixels):
        single = released.solve(PAPER_OBJECT, image, camera, theta_centre=CENTRE)
        np.testing.assert_allclose(single.cam_from_obj.R, batch.cam_from_obj.R[i], rtol=0, atol=1e-12)
        np.testing.assert_allclose(single.cam_from_obj.t, batch.cam_from_obj.t[i], rtol=1e-12)
    shift = np.array([30.0, -20.0, 10.0])
    moved = released.solve(PAPER_OBJECT + shift, pixels, camera, theta_centre=CENTRE).cam_from_obj
    # Rounding of the offsets, 1e-16, over the object's condition of 4.
    np.testing.assert_allclose(moved.t + moved.R @ shift, batch.cam_from_obj.t, rtol=1e-11)
