"""The solver on exact and on noisy points: what is promised, nothing left out."""

import numpy as np
import pytest

import eposit
from eposit import LENS_NAMES, Camera, Pose
from eposit.pose import rotation_error_rad, rotation_error_vector
from eposit.refine.weights import covariance, normal_equations, whitening
from tests.cameras import ALL_CAMERAS, PAPER_OBJECT, PAST_90, helix_pose, paper_camera, random_object, random_pose

PROBLEMS = 2000


def errors(solution, pose):
    """Rotation error, rad, and relative translation error."""
    relative = np.linalg.norm(solution.cam_from_obj.t - pose.t, axis=-1) / np.linalg.norm(pose.t, axis=-1)
    return rotation_error_rad(solution.cam_from_obj.R, pose.R), relative


def problems(camera, seed, count, limit_deg, ratio, poses_each=10):
    """Objects, the paper's every fourth time, each with a batch of poses and its exact image points."""
    rng = np.random.default_rng(seed)
    for i in range(count // poses_each):
        points = PAPER_OBJECT if i % 4 == 0 else random_object(rng)
        poses = [random_pose(rng, points, limit_deg, rng.uniform(*ratio)) for _ in range(poses_each)]
        pose = Pose(np.stack([one.R for one in poses]), np.stack([one.t for one in poses]))
        yield points, pose, camera.project(pose.apply(points))


@pytest.mark.parametrize("camera", ALL_CAMERAS, ids=lambda camera: camera.lens)
def test_default_solver_is_exact(camera):
    # At 85 degrees the polynomial of the distorted pinhole is at 5e8 px, where doubles are good to 1e-7 px.
    limit = 100.0 if camera.lens in PAST_90 else 70.0 if camera.lens == "pinhole_radial" else 85.0
    for points, pose, pixels in problems(camera, 11, PROBLEMS, limit, (0.02, 0.3)):
        solution = eposit.solve(points, pixels, camera)
        assert set(solution.status) == {"ok"}
        rotation, translation = errors(solution, pose)
        assert rotation.max() < 1e-9
        assert translation.max() < 1e-10


@pytest.mark.parametrize("camera", ALL_CAMERAS, ids=lambda camera: camera.lens)
def test_plain_eposit_is_exact_inside_its_range(camera):
    for points, pose, pixels in problems(camera, 12, PROBLEMS, 40.0, (0.02, 0.1)):
        solution = eposit.solve(points, pixels, camera, "eposit")
        assert set(solution.status) == {"ok"}
        rotation, translation = errors(solution, pose)
        assert rotation.max() < 1e-9
        assert translation.max() < 1e-10


@pytest.mark.parametrize("lens", ["perspective", "equisolid", "orthogonal"])
@pytest.mark.parametrize("method", ["eposit", "posit", "centred"])
def test_a_linear_method_never_calls_a_wrong_pose_ok(lens, method):
    camera = paper_camera(lens)
    good = failed = 0
    for points, pose, pixels in problems(camera, 13, 2000, 110.0 if lens in PAST_90 else 88.0, (0.02, 0.3)):
        solution = eposit.solve(points, pixels, camera, method, max_iterations=300)
        ok = solution.status == "ok"
        good, failed = good + int(ok.sum()), failed + int((~ok).sum())
        # Near its limit the iteration contracts by 0.99 a step: the last step of 1e-12 leaves 1e-10.
        assert np.all(errors(solution, pose)[0][ok] < 1e-7)
        assert np.isnan(solution.cam_from_obj.R[~ok]).all()
    assert good > 300
    if method != "centred":  # beyond 54.7 degrees the iteration no longer contracts
        assert failed > 300


@pytest.mark.parametrize("lens", ["perspective", "orthogonal"])
def test_noise_reaches_the_cramer_rao_bound(lens):
    """0.4 px on the paper's helix: error over its own frame's bound has an RMS of 1 in all six components."""
    camera, rng, sigma, draws = paper_camera(lens), np.random.default_rng(14), 0.4, 14
    normalised = []
    for t in range(361):
        pose = helix_pose(t)
        pixels = camera.project(pose.apply(PAPER_OBJECT))
        noisy = pixels + sigma * rng.standard_normal((draws, 4, 2))
        solution = eposit.solve(PAPER_OBJECT, noisy, camera, sigma_px=sigma)
        assert list(solution.status) == ["ok"] * draws
        u, v = pixels.T[:, :, None]
        weights = whitening(np.asarray(sigma), 4)
        normal, _ = normal_equations(camera, PAPER_OBJECT, u, v, pose.R[None], pose.t[None], weights)
        bound = np.sqrt(np.diag(covariance(normal)[0]))
        rotation = rotation_error_vector(solution.cam_from_obj.R, np.broadcast_to(pose.R, (draws, 3, 3)))
        normalised.append(np.hstack((rotation, solution.cam_from_obj.t - pose.t)) / bound)
    errors_over_bound = np.vstack(normalised)
    assert len(errors_over_bound) >= 5000
    # An RMS over 5054 normal draws scatters by 1 / sqrt(2 n) = 0.010: 0.05 is five of those. Flips would show here:
    # a single one, 20 to 100 bounds away, moves the RMS by 0.04 to 0.7.
    rms = np.sqrt(np.mean(errors_over_bound**2, axis=0))
    assert np.all((rms > 0.95) & (rms < 1.05)), rms
    assert np.sum(np.abs(errors_over_bound) > 8.0) == 0  # flips


@pytest.mark.parametrize("method", eposit.METHODS)
def test_batch_equals_single_calls(method):
    camera, rng = paper_camera("equisolid"), np.random.default_rng(15)
    poses = [random_pose(rng, PAPER_OBJECT, 60.0, 0.1) for _ in range(40)]
    pixels = np.stack([camera.project(pose.apply(PAPER_OBJECT)) for pose in poses]) + 0.3 * rng.normal(size=(40, 4, 2))
    batch = eposit.solve(PAPER_OBJECT, pixels, camera, method)
    for i, single in enumerate(eposit.solve(PAPER_OBJECT, one, camera, method) for one in pixels):
        assert single.status == batch.status[i]
        np.testing.assert_allclose(batch.cam_from_obj.R[i], single.cam_from_obj.R, rtol=0, atol=1e-12)
        np.testing.assert_allclose(batch.cam_from_obj.t[i], single.cam_from_obj.t, rtol=1e-12)


@pytest.mark.parametrize("method", eposit.METHODS)
def test_a_batch_may_be_empty(method):
    found = eposit.solve(PAPER_OBJECT, np.empty((0, 4, 2)), paper_camera("equisolid"), method)
    assert found.status.shape == (0,)
    assert found.covariance.shape == (0, 6, 6)


@pytest.mark.parametrize("camera", ALL_CAMERAS, ids=lambda camera: camera.lens)
@pytest.mark.parametrize("tilt", [0.0, 30.0, 70.0])
def test_plain_chessboard_needs_no_circle(camera, tilt):
    y, x = np.mgrid[0:6, 0:9] * 100.0
    board = np.stack((x.ravel(), y.ravel(), 0.0 * x.ravel()), axis=1)
    R = eposit.pose.rotation_from_euler(np.deg2rad([tilt, 0.4 * tilt, 10.0]))
    pose = Pose(R, np.array([-300.0, -200.0, 1500.0]))
    solution = eposit.solve(board, camera.project(pose.apply(board)), camera)
    rotation, translation = errors(solution, pose)
    assert solution.status == "ok"
    assert rotation < 1e-9
    assert translation < 1e-10


def test_both_planar_minima_are_tried():
    """A small far board under noise: the lower of the two minima is taken, so the error stays unimodal."""
    camera, rng = paper_camera("perspective"), np.random.default_rng(16)
    y, x = np.mgrid[0:3, 0:3] * 100.0
    board = np.stack((x.ravel(), y.ravel(), 0.0 * x.ravel()), axis=1)
    pose = Pose(eposit.pose.rotation_from_euler(np.deg2rad([35.0, 10.0, 5.0])), np.array([50.0, -80.0, 2500.0]))
    pixels = camera.project(pose.apply(board)) + 0.2 * rng.standard_normal((300, 9, 2))
    solution = eposit.solve(board, pixels, camera)
    assert set(solution.status) == {"ok"}
    assert np.degrees(errors(solution, pose)[0]).max() < 10.0


def test_a_close_object_whose_wrong_pose_nearly_fits_gets_the_right_one():
    """As large as half its distance, this object has a second minimum with a misfit that a distant one never has.

    Centred EPOSIT leads to that minimum, 0.9 rad away and 3.6 px off: only the other starts find the pose.
    """
    points = np.array([(0.0, 0.0, 0.0), (26.3, -41.0, 26.1), (-190.7, -53.5, -27.7), (-5.8, 99.1, -117.3)])
    R = eposit.pose.rotation_from_euler(np.deg2rad([25.2, 8.3, 11.6]))
    camera, pose = paper_camera("perspective"), Pose(R, np.array([21.0, -32.7, 455.0]))
    solution = eposit.solve(points, camera.project(pose.apply(points)), camera)
    assert solution.status == "ok"
    rotation, translation = errors(solution, pose)
    assert rotation < 1e-9
    assert translation < 1e-10


def test_statuses():
    camera = paper_camera("orthogonal")
    pose = helix_pose(0.0)
    pixels = camera.project(pose.apply(PAPER_OBJECT))
    flat = PAPER_OBJECT * (1.0, 1.0, 0.0) + [(0, 0, 0), (0, 0, 0), (0, 0, 0), (150.0, 150.0, 0)]
    broken = pixels.copy()
    broken[2, 0] = np.nan
    outside = pixels.copy()
    outside[1] = [camera.cx + 1.06 * camera.fx, camera.cy]
    assert eposit.solve(PAPER_OBJECT, broken, camera).status == "non_finite"
    assert eposit.solve(PAPER_OBJECT, outside, camera).status == "outside_lens"
    for method in eposit.METHODS:
        found = eposit.solve(flat, camera.project(pose.apply(flat)), camera, method)
        assert found.status == ("ok" if method == "best" else "coplanar")
    past = paper_camera("equidistance")
    far = Pose(pose.R, np.array([2000.0, 0.0, -50.0]))
    assert (
        eposit.solve(PAPER_OBJECT, past.project(far.apply(PAPER_OBJECT)), past, "eposit").status == "beyond_90_degrees"
    )
    assert eposit.solve(PAPER_OBJECT, past.project(far.apply(PAPER_OBJECT)), past).status == "ok"


def test_noise_at_the_rim_of_the_lens_is_no_failure():
    """At 88 degrees on the orthogonal lens a quarter of the noisy points lie outside the image circle."""
    camera, rng = paper_camera("orthogonal"), np.random.default_rng(17)
    direction = np.array([np.sin(np.deg2rad(87.0)), 0.0, np.cos(np.deg2rad(87.0))])
    pose = Pose(eposit.pose.rotation_from_euler([0.1, -1.2, 0.3]), 1500.0 * direction)
    pixels = camera.project(pose.apply(PAPER_OBJECT)) + 0.4 * rng.standard_normal((200, 4, 2))
    outside = np.hypot(*((pixels - [camera.cx, camera.cy]) / [camera.fx, camera.fy]).T).T > 1.0
    assert outside.any()
    solution = eposit.solve(PAPER_OBJECT, pixels, camera)
    assert np.isfinite(solution.cam_from_obj.t[solution.status == "ok"]).all()
    assert np.mean(solution.status == "ok") > 0.95


def test_covariance_is_absolute_with_sigma_and_scaled_without():
    camera, rng = paper_camera("stereographic"), np.random.default_rng(18)
    points = np.vstack((PAPER_OBJECT, rng.uniform(-150, 150, (26, 3))))
    pose = helix_pose(90.0)
    pixels = camera.project(pose.apply(points)) + 0.2 * rng.normal(size=(30, 2))
    absolute = eposit.solve(points, pixels, camera, sigma_px=0.2).covariance
    each = eposit.solve(points, pixels, camera, sigma_px=np.full(30, 0.2)).covariance
    full = eposit.solve(points, pixels, camera, sigma_px=np.broadcast_to(0.04 * np.eye(2), (30, 2, 2))).covariance
    scaled = eposit.solve(points, pixels, camera).covariance
    np.testing.assert_allclose(each, absolute, rtol=1e-9)
    np.testing.assert_allclose(full, absolute, rtol=1e-9)
    # Without sigma it is estimated from 54 degrees of freedom: the variance is good to sqrt(2 / 54) = 0.19, times 4.
    assert abs(scaled[0, 0] / absolute[0, 0] - 1.0) < 0.8


def test_the_released_example():
    """One noise-free frame of the paper's simulation, printed in the authors' public example."""
    camera = Camera(
        lens="perspective", fx=1378.65, fy=1381.37, cx=807.41661, cy=602.4737, width=1600, height=1200
    )  # fmt: skip
    points = np.array([(0.0, 0, 0), (0, 0, -10), (50, 0, -10), (0, 50, -10)])
    pixels = [(876.3492, 671.5425), (873.7555, 673.3157), (905.1681, 685.1693), (865.9635, 704.5122)]
    pose = Pose(eposit.pose.rotation_from_euler(np.deg2rad([20.0, 20.0, 20.0])), np.array([100.0, 100.0, 2000.0]))
    # Printed to 4 decimals, made from intrinsics printed to 2: they agree within 0.006 px.
    np.testing.assert_allclose(camera.project(pose.apply(points)), pixels, rtol=0, atol=0.006)


@pytest.mark.parametrize(
    ("points", "pixels", "options"),
    [
        (PAPER_OBJECT[:3], np.zeros((3, 2)), {}),
        (PAPER_OBJECT[:, :2], np.zeros((4, 2)), {}),
        (PAPER_OBJECT, np.zeros((5, 2)), {}),
        (PAPER_OBJECT * np.nan, np.zeros((4, 2)), {}),
        (PAPER_OBJECT, np.zeros((4, 2)), {"method": "magic"}),
        (PAPER_OBJECT, np.zeros((4, 2)), {"sigma_px": -1.0}),
        (PAPER_OBJECT, np.zeros((4, 2)), {"sigma_px": np.ones(3)}),
        (PAPER_OBJECT, np.zeros((4, 2)), {"sigma_px": -np.ones((4, 2, 2))}),
        (PAPER_OBJECT, np.zeros((4, 2)), {"theta_centre": (800.0, 600.0)}),
    ],
)
def test_a_wrong_call_is_a_sentence(points, pixels, options):
    with pytest.raises(ValueError, match=r"\w+ .*"):
        eposit.solve(points, pixels, paper_camera("equidistance"), **options)


def test_lens_names_are_the_papers_five_and_those_of_calibrations():
    assert LENS_NAMES == (
        "perspective", "stereographic", "equidistance", "equisolid", "orthogonal", "kannala_brandt",
        "pinhole_radial", "eucm", "double_sphere",
    )  # fmt: skip


@pytest.mark.parametrize("method", eposit.METHODS)
def test_the_object_frame_need_not_start_at_m0(method):
    camera, shift = paper_camera("equisolid"), np.array([100.0, 50.0, -70.0])
    pixels = camera.project(np.stack([helix_pose(t).apply(PAPER_OBJECT) for t in (0.0, 90.0, 300.0)]))
    at_m0 = eposit.solve(PAPER_OBJECT, pixels, camera, method)
    moved = eposit.solve(PAPER_OBJECT + shift, pixels, camera, method)
    assert list(moved.status) == ["ok"] * 3
    np.testing.assert_allclose(moved.cam_from_obj.t + moved.cam_from_obj.R @ shift, at_m0.cam_from_obj.t, rtol=1e-9)
