"""Other people's solvers through adapters: exact data, each lens; what they cannot take is a status."""

import subprocess
import sys

import numpy as np
import pytest

import eposit.released
from datasets.errors import UserError
from eposit.pose import rotation_error_rad
from pipelines.adapters.registry import SOLVERS, check_solver, find_solver, solver_names, takes_four, takes_theta_centre
from pipelines.commands import options
from pipelines.stages.settings import settings_of
from tests.cameras import ALL_CAMERAS, PAPER_OBJECT, PAST_90, helix_pose, paper_camera, random_object, random_pose

SIX_POINTS = ("opencv-sqpnp", "opencv-epnp", "opencv-iterative")
FOUR_POINTS = ("opencv-p3p", "poselib-p3p", "poselib-p4pf")
ADAPTERS = [name for name in SOLVERS if name.startswith(("opencv", "poselib"))]
FISHEYE = ("equidistance", "kannala_brandt")


def errors(name, camera, n, limit_deg, count=40):
    """(count,) rotation errors, rad, and (count,) relative position errors on exact points."""
    rng, solver = np.random.default_rng(7), find_solver(name)
    rotation, position = [], []
    for _ in range(count):
        # A well-shaped object moved off its origin: M0 is not always the origin of the frame.
        points = random_object(rng, n, condition=5.0)
        pose = random_pose(rng, points, limit_deg, 0.2)
        found = solver(points, camera.project(pose.apply(points)), camera)
        assert found.status == "ok"
        rotation.append(rotation_error_rad(found.cam_from_obj.R, pose.R))
        position.append(np.linalg.norm(found.cam_from_obj.t - pose.t) / np.linalg.norm(pose.t))
        assert found.reprojection_rmse_px < 1e-2  # p4pf has the focal length from four points, to 1e-6 of it
    return np.array(rotation), np.array(position)


@pytest.mark.parametrize("camera", ALL_CAMERAS, ids=lambda camera: camera.lens)
@pytest.mark.parametrize(("name", "n"), [*((name, 6) for name in SIX_POINTS), *((name, 4) for name in FOUR_POINTS)])
def test_exact_points_give_the_true_pose(name, n, camera):
    rotation, position = errors(name, camera, n, 60.0)
    assert rotation.max() < 1e-6
    assert position.max() < 1e-6


@pytest.mark.parametrize("lens", FISHEYE)
def test_opencvs_own_fisheye_model_is_ours(lens):
    """OpenCV undistorts by its own model: that it finds the pose to 85 degrees ties both models to each other."""
    rotation, position = errors("opencv-fisheye", paper_camera(lens), 6, 85.0)
    assert rotation.max() < 1e-6
    assert position.max() < 1e-6


@pytest.mark.parametrize("lens", sorted(PAST_90))
def test_rays_have_no_limit_of_ninety_degrees(lens):
    rotation, position = errors("poselib-p3p", paper_camera(lens), 4, 100.0)
    assert rotation.max() < 1e-6
    assert position.max() < 1e-6


def test_sqpnp_takes_four_points():
    """From four points it sometimes gives another stationary pose, also of exact data: 1 of 300 was measured."""
    rng, camera, solver = np.random.default_rng(3), paper_camera("orthogonal"), find_solver("opencv-sqpnp")
    good = 0
    for _ in range(100):
        points = random_object(rng, 4, condition=5.0)
        pose = random_pose(rng, points, 60.0, 0.2)
        found = solver(points, camera.project(pose.apply(points)), camera)
        good += found.status == "ok" and rotation_error_rad(found.cam_from_obj.R, pose.R) < 1e-6
    assert good >= 97


@pytest.mark.parametrize("name", ["opencv-p3p", "opencv-sqpnp", "poselib-p3p", "poselib-p4pf"])
def test_a_frame_of_an_object_may_lie_beside_it(name):
    camera, pose, solver = paper_camera("equisolid"), helix_pose(30.0), find_solver(name)
    moved = PAPER_OBJECT + (900.0, -700.0, 400.0)
    origin = pose.t - pose.R @ (900.0, -700.0, 400.0)
    found = solver(moved, camera.project(pose.apply(PAPER_OBJECT)), camera)
    assert rotation_error_rad(found.cam_from_obj.R, pose.R) < 1e-6
    np.testing.assert_allclose(found.cam_from_obj.t, origin, rtol=0.0, atol=1e-3)  # mm, of 2 m: some 1e-7


def test_a_focal_length_that_is_wrong_does_not_matter_to_p4pf():
    camera, pose = paper_camera("perspective"), helix_pose(60.0)
    pixels = camera.project(pose.apply(PAPER_OBJECT))
    wrong = camera.replace(fx=0.8 * camera.fx, fy=0.8 * camera.fy)
    assert rotation_error_rad(find_solver("poselib-p4pf")(PAPER_OBJECT, pixels, wrong).cam_from_obj.R, pose.R) < 1e-6
    assert rotation_error_rad(find_solver("poselib-p3p")(PAPER_OBJECT, pixels, wrong).cam_from_obj.R, pose.R) > 1e-3


@pytest.mark.parametrize("name", ADAPTERS)
def test_a_batch_is_single_calls(name):
    camera, solver = paper_camera("equidistance"), find_solver(name)
    n = 4 if takes_four(name) else 7
    points = random_object(np.random.default_rng(1), n)
    batch = np.stack([camera.project(helix_pose(t).apply(points)) for t in (0.0, 90.0, 180.0)])
    batch[1, 2] = np.nan
    together = solver(points, batch, camera)
    assert together.status.tolist() == ["ok", "non_finite", "ok"]
    for i, image in enumerate(batch):
        alone = solver(points, image, camera)
        assert alone.status == together.status[i]
        np.testing.assert_allclose(alone.cam_from_obj.R, together.cam_from_obj.R[i], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(alone.cam_from_obj.t, together.cam_from_obj.t[i], rtol=1e-12)
        np.testing.assert_array_equal(alone.reprojection_rmse_px, together.reprojection_rmse_px[i])
    assert np.isnan(together.covariance).all()
    assert np.isnan(together.cam_from_obj.R[1]).all()


def test_the_reprojection_error_is_that_of_the_lens():
    camera, pose = paper_camera("stereographic"), helix_pose(10.0)
    pixels = camera.project(pose.apply(PAPER_OBJECT)) + np.random.default_rng(2).normal(scale=0.5, size=(4, 2))
    found = find_solver("opencv-sqpnp")(PAPER_OBJECT, pixels, camera)
    miss = [camera.project(found.cam_from_obj.apply(PAPER_OBJECT))[i] - pixels[i] for i in range(4)]
    by_hand = np.sqrt(sum(u * u + v * v for u, v in miss) / 4.0)
    assert found.reprojection_rmse_px == pytest.approx(by_hand, rel=1e-12)


def wide_image(theta_deg):
    """Six points of an equidistance camera, the last one at an angle from the axis."""
    camera, points = paper_camera("equidistance"), random_object(np.random.default_rng(5), 6)
    pixels = camera.project(helix_pose(0.0).apply(points))
    pixels[5] = (camera.cx + camera.fx * np.deg2rad(theta_deg), camera.cy)
    return points, pixels, camera


@pytest.mark.parametrize("name", [*SIX_POINTS, "opencv-fisheye"])
def test_where_a_pinhole_has_no_image_is_a_status(name):
    for theta_deg, status in (
        (89.0, "ok"),
        (90.0 + 1e-9, "beyond_90_degrees"),
        (100.0, "beyond_90_degrees"),
        (181.0, "outside_lens"),
    ):
        found = find_solver(name)(*wide_image(theta_deg))
        assert found.status == status
        assert np.isnan(found.cam_from_obj.t).any() == (status != "ok")


@pytest.mark.parametrize("n", [4, 5])
@pytest.mark.parametrize("name", ["opencv-iterative", "opencv-fisheye"])
def test_too_few_points_are_a_status(name, n):
    camera, points = paper_camera("equidistance"), random_object(np.random.default_rng(4), n)
    found = find_solver(name)(points, camera.project(helix_pose(0.0).apply(points)), camera)
    assert found.status == "too_few_points"
    assert np.isnan(found.cam_from_obj.R).all()


@pytest.mark.parametrize("lens", ["perspective", "stereographic", "equisolid", "orthogonal"])
def test_a_lens_that_opencv_has_no_model_of_is_a_status(lens):
    camera, points = paper_camera(lens), random_object(np.random.default_rng(4), 6)
    found = find_solver("opencv-fisheye")(points, camera.project(helix_pose(0.0).apply(points)), camera)
    assert found.status == "unsupported_lens"


@pytest.mark.parametrize("name", ADAPTERS)
def test_wrong_shapes_are_sentences(name):
    camera = paper_camera("perspective")
    with pytest.raises(ValueError, match="points_in_obj has shape"):
        find_solver(name)(np.zeros((3, 3)), np.zeros((3, 2)), camera)
    with pytest.raises(ValueError, match=r"points_px has shape \(3, 2\); it must be \(4, 2\)"):
        find_solver(name)(PAPER_OBJECT, np.zeros((3, 2)), camera)


def test_names():
    assert solver_names()[:4] == ("best", "centred", "eposit", "posit")
    assert {name for name in solver_names() if takes_four(name)} == {*FOUR_POINTS, "pnpfr"}
    assert [name for name in solver_names() if takes_theta_centre(name)] == ["eposit", "released"]
    for name in solver_names():
        check_solver(name, "four")
    assert {setting.use for setting in settings_of(["opencv-p3p"])} == {"four"}
    assert {setting.use for setting in settings_of(["opencv-epnp"])} == {"all"}
    with pytest.raises(UserError, match="poselib-p3p takes exactly four points; add --use four"):
        check_solver("poselib-p3p", "all")
    with pytest.raises(UserError, match=r"unknown solver 'upnp'; choose one of best, .* package\.module:function"):
        find_solver("upnp")


def test_the_compared_solvers_are_found_by_name():
    camera, pose = paper_camera("orthogonal"), helix_pose(20.0)
    pixels = camera.project(pose.apply(PAPER_OBJECT))
    found = find_solver("opnp")(PAPER_OBJECT, pixels, camera, sigma_px=0.4)
    assert rotation_error_rad(found.cam_from_obj.R, pose.R) < 1e-9
    released = find_solver("released")(PAPER_OBJECT, pixels[None], camera, sigma_px=0.4, theta_centre=(800.0, 600.0))
    direct = eposit.released.solve(PAPER_OBJECT, pixels[None], camera, theta_centre=(800.0, 600.0))
    np.testing.assert_array_equal(released.cam_from_obj.t, direct.cam_from_obj.t)


def test_the_help_names_every_solver():
    for name in solver_names():
        assert f"{name}, " in options.SOLVERS_HELP


def test_the_command_line_loads_no_other_solver():
    code = (
        "import sys, pipelines.cli, pipelines.adapters.registry\n"
        "heavy = {'cv2', 'poselib', 'pyarrow'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
