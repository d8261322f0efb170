"""OPnP against closed forms, OpenCV's SQPnP, SciPy's minimisers and the Cramer-Rao bound."""

from itertools import product

import cv2
import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

import eposit
from eposit import Pose, opnp
from eposit.opnp.critical_points import FIRST, SECOND, critical_points
from eposit.pose import rotation_error_rad, rotation_error_vector
from eposit.refine.weights import covariance, normal_equations, whitening
from tests.cameras import ALL_CAMERAS, PAPER_OBJECT, PAPER_PINHOLE, helix_pose, paper_camera, random_pose

# The simulation's principal point to all its decimals.
PINHOLE = paper_camera("perspective").replace(**PAPER_PINHOLE | {"cx": 807.41661, "cy": 602.4737})
# Condition of the information, scaled to a unit diagonal, above which a problem is degenerate: its root loses digits.
DEGENERATE = 1e6


def information(camera, points, pose, sigma=1.0):
    u, v = camera.project(pose.apply(points)).T[:, :, None]
    weights = whitening(np.asarray(sigma), len(points))
    return normal_equations(camera, points, u, v, pose.R[None], pose.t[None], weights)[0]


def degenerate(camera, points, pose):
    normal = information(camera, points, pose)[0]
    scale = np.sqrt(np.diag(normal))
    return np.linalg.cond(normal / np.outer(scale, scale)) > DEGENERATE


def cost_of(points, image, quaternion, sight):
    """The docstring's cost; quaternion (4,) scaled so that its square is 1 over the depth."""
    w, x, y, z = quaternion
    rotation = np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
    place = (points - points.mean(axis=0)) @ rotation.T
    return np.sum(((1.0 + place[:, 2:]) * image - place[:, :2] - sight) ** 2)


def cost_of_pose(points, image, R, t):
    centre = R @ points.mean(axis=0) + t
    xyzw = Rotation.from_matrix(R).as_quat() / np.sqrt(centre[2])
    return cost_of(points, image, np.roll(xyzw, 1), centre[:2] / centre[2])


def noisy_image(seed, sigma_px=2.0, n=5):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(n, 3)) * 200.0
    pixels = PINHOLE.project(random_pose(rng, points, 40.0, 0.3).apply(points))
    pixels = pixels + sigma_px * rng.normal(size=(n, 2))
    rays = PINHOLE.bearing(pixels)
    return points, pixels, rays[:, :2] / rays[:, 2:]


@pytest.mark.parametrize(("n", "count"), [pytest.param(4, 1000, marks=pytest.mark.full), (6, 200), (10, 200)])
def test_exact_points_give_the_exact_pose_and_forty_pairs(n, count):
    rng, excluded = np.random.default_rng(n), 0
    for _ in range(count // 10):
        points = rng.normal(size=(n, 3)) * 200.0
        poses = [random_pose(rng, points, 60.0, rng.uniform(0.02, 0.5)) for _ in range(10)]
        kept = [pose for pose in poses if not degenerate(PINHOLE, points, pose)]
        excluded += 10 - len(kept)
        pose = Pose(np.stack([one.R for one in kept]), np.stack([one.t for one in kept]))
        solution = opnp.solve(points, PINHOLE.project(pose.apply(points)), PINHOLE)
        assert set(solution.status) == {"ok"}
        assert set(solution.pairs) == {40}
        # The worst of thousands is 1e-13; the promise is 1e-10.
        assert rotation_error_rad(solution.cam_from_obj.R, pose.R).max() < 1e-11
        np.testing.assert_allclose(solution.cam_from_obj.t, pose.t, atol=1e-9 * np.abs(pose.t).max())
    assert excluded <= count // 100


@pytest.mark.parametrize("camera", ALL_CAMERAS, ids=lambda camera: camera.lens)
def test_every_lens_below_90_degrees(camera):
    rng = np.random.default_rng(3)
    poses = [random_pose(rng, PAPER_OBJECT, 85.0, 0.2) for _ in range(20)]
    pose = Pose(np.stack([one.R for one in poses]), np.stack([one.t for one in poses]))
    solution = opnp.solve(PAPER_OBJECT, camera.project(pose.apply(PAPER_OBJECT)), camera)
    # At 85 degrees pinhole coordinates amplify the pixels' rounding of 1e-13 px by 1 / cos^2 = 130.
    assert rotation_error_rad(solution.cam_from_obj.R, pose.R).max() < 1e-10


@pytest.mark.parametrize("lens", ["perspective", "orthogonal"])
def test_noise_reaches_the_bound_as_opencvs_sqpnp_does(lens):
    """0.4 px on every eighth frame of the paper's helix, ten draws each; errors over their own frame's bound."""
    camera = PINHOLE if lens == "perspective" else paper_camera(lens)
    rng, draws, sigma = np.random.default_rng(14), 10, 0.4
    ours, theirs, likeliest = [], [], []
    for time in range(0, 361, 8):
        pose = helix_pose(time)
        pixels = camera.project(pose.apply(PAPER_OBJECT)) + sigma * rng.standard_normal((draws, 4, 2))
        bound = np.sqrt(np.diag(covariance(information(camera, PAPER_OBJECT, pose, sigma))[0]))
        solution = opnp.solve(PAPER_OBJECT, pixels, camera)
        assert list(solution.status) == ["ok"] * draws
        rays = camera.bearing(pixels)
        found = [sqpnp(PAPER_OBJECT, image) for image in rays[..., :2] / rays[..., 2:]]
        best = eposit.solve(PAPER_OBJECT, pixels, camera)
        for errors, R, t in (
            (ours, solution.cam_from_obj.R, solution.cam_from_obj.t),
            (theirs, *map(np.stack, zip(*found, strict=True))),
            (likeliest, best.cam_from_obj.R, best.cam_from_obj.t),
        ):
            rotation = rotation_error_vector(R, np.broadcast_to(pose.R, R.shape))
            errors.append(np.hstack((rotation, t - pose.t)) / bound)
    ours, theirs, likeliest = (np.abs(np.vstack(errors)) for errors in (ours, theirs, likeliest))
    np.testing.assert_allclose(np.median(ours, axis=0), np.median(theirs, axis=0), rtol=0.03)
    assert ours.max() < 8.0  # no flips; SQPnP has some
    # An RMS of 460 draws scatters by 1 / sqrt(920) = 3.3 %: four of those.
    np.testing.assert_allclose(np.sqrt(np.mean(ours**2, axis=0)), 1.0, atol=0.132)
    # On the same draws the scatter cancels: the algebraic cost loses less than 1 % to maximum likelihood.
    np.testing.assert_allclose(np.sqrt(np.mean(ours**2, axis=0) / np.mean(likeliest**2, axis=0)), 1.0, atol=0.01)


def sqpnp(points, image):
    _, vector, position = cv2.solvePnP(points, image, np.eye(3), None, flags=cv2.SOLVEPNP_SQPNP)
    return cv2.Rodrigues(vector)[0], position[:, 0]


@pytest.mark.parametrize("signs", list(product((1.0, -1.0), repeat=4))[::3])
def test_forty_pairs_in_closed_form(signs):
    """The sum of (z_i^2 - a_i)^2 has the critical points z_i = 0 or +-sqrt(a_i): 81, the zero among them."""
    a = np.array(signs) * [0.7, 1.3, 0.4, 2.0]
    turn = Rotation.random(None, np.random.default_rng(2)).as_matrix()
    turn = np.block([[turn, np.zeros((3, 1))], [np.zeros((1, 3)), 1.0]]) @ np.linalg.qr(np.vander([1, 2, 3, 5.0]))[0]
    squares = turn[:, FIRST] * turn[:, SECOND] * np.where(FIRST == SECOND, 1.0, 2.0)  # z = turn @ y
    y, pairs = critical_points(squares[None], -a[None])
    assert pairs[0] == 40
    found = y[0] @ turn.T
    roots = [np.array(root) for root in product(*((0.0, s, -s) for s in np.sqrt(a.astype(complex))))]
    for root in roots:
        if np.any(root):
            distance = np.minimum(np.linalg.norm(found - root, axis=1), np.linalg.norm(found + root, axis=1))
            assert distance.min() < 1e-12


def test_the_selected_pose_is_the_global_minimum_of_the_cost():
    """Quasi-Newton from random starts on the cost written out plainly finds nothing lower, and the same value."""
    rng = np.random.default_rng(6)
    for seed in range(2):
        points, pixels, image = noisy_image(seed)
        solution = opnp.solve(points, pixels, PINHOLE)
        depth = (solution.cam_from_obj.R @ points.mean(axis=0) + solution.cam_from_obj.t)[2]
        unit = points / depth  # quaternions of about unit length
        lowest = min(minimum(unit, image, rng.normal(size=6)) for _ in range(12))
        assert lowest == pytest.approx(solution.candidates.cost[0], rel=1e-6)  # where BFGS stops


def minimum(points, image, start):
    return minimize(lambda x: cost_of(points, image, x[:4], x[4:]), start, tol=1e-12).fun


def test_candidates_are_critical_points_with_the_costs_that_they_state():
    for seed in range(5):
        points, pixels, image = noisy_image(seed)
        found = opnp.solve(points, pixels, PINHOLE).candidates
        assert found.count == len(found.cost) >= 1
        assert np.all(np.diff(found.cost) >= 0.0)
        for R, t, cost in zip(found.poses.R, found.poses.t, found.cost, strict=True):
            assert cost_of_pose(points, image, R, t) == pytest.approx(cost, rel=1e-9)
            np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
            for direction in np.eye(6):  # central differences: the slope is below the curvature's share of a step
                ahead, behind = (moved(points, R, t, step * direction) for step in (1e-5, -1e-5))
                slope = (cost_of_pose(points, image, *ahead) - cost_of_pose(points, image, *behind)) / 2e-5
                assert abs(slope) < 1e-7


def moved(points, R, t, step):
    """Turned about the centroid by step[:3], rad, and moved by step[3:] times its depth."""
    turn, centre = Rotation.from_rotvec(step[:3]).as_matrix(), R @ points.mean(axis=0) + t
    centre = centre + step[3:] * centre[2]
    return turn @ R, centre - turn @ R @ points.mean(axis=0)


def test_points_behind_the_camera_are_not_chosen():
    """Images of nothing, on a wide picture: often the lowest cost belongs to a pose with points behind the camera."""
    rng, camera, passed_over, none = np.random.default_rng(0), PINHOLE.replace(fx=345.0, fy=345.0), 0, 0
    for _ in range(10):
        points = rng.normal(size=(4, 3)) * 100.0
        solution = opnp.solve(points, rng.uniform(0, 1600, (20, 4, 2)), camera)
        for i, status in enumerate(solution.status):
            k = solution.candidates.count[i]
            poses = Pose(solution.candidates.poses.R[i, :k], solution.candidates.poses.t[i, :k])
            front = np.flatnonzero(np.all(poses.apply(points)[..., 2] > 0.0, axis=1))
            assert status == ("ok" if len(front) else "no_solution")
            passed_over, none = passed_over + (len(front) > 0 and front[0] > 0), none + (len(front) == 0)
            if len(front):
                np.testing.assert_array_equal(solution.cam_from_obj.t[i], poses.t[front[0]])
    assert passed_over > 20
    assert none > 0


def test_roots_that_merge_are_one_candidate():
    """Between two images with a different number of real roots lies one where two of them meet."""
    images = np.random.default_rng(2).uniform(400.0, 1000.0, (20, 4, 2))
    counts = opnp.solve(PAPER_OBJECT, images, PINHOLE).candidates.count
    other = np.flatnonzero(counts != counts[0])[0]
    low, high = images[0], images[other]
    for _ in range(50):
        found = opnp.solve(PAPER_OBJECT, 0.5 * (low + high), PINHOLE)
        k = found.candidates.count
        apart = rotation_error_rad(found.candidates.poses.R[:, None], found.candidates.poses.R[None])
        # A root of multiplicity two is known to the root of 1e-16.
        assert apart[~np.eye(k, dtype=bool)].min(initial=1.0) > 1e-8
        low, high = (0.5 * (low + high), high) if k == counts[0] else (low, 0.5 * (low + high))
    assert found.status == "ok"


def test_four_points_of_a_plane_are_enough():
    square = np.array([(0.0, 0, 0), (200, 0, 0), (0, 200, 0), (200, 200, 0)])
    for tilt in (0.0, 20.0, 60.0):
        pose = Pose(Rotation.from_euler("xyz", [tilt, 0.5 * tilt, 0.0], True).as_matrix(), np.array([-90.0, 30, 1500]))
        solution = opnp.solve(square, PINHOLE.project(pose.apply(square)), PINHOLE)
        assert solution.status == "ok"
        assert rotation_error_rad(solution.cam_from_obj.R, pose.R) < 1e-12
        # A square seen head-on has curves of complex critical points: the pose is found, and the count says so.
        assert (solution.pairs == 40) == (tilt > 0.0)


def test_three_distinct_points_have_all_their_poses_among_the_candidates():
    points, pose = PAPER_OBJECT[[0, 1, 3, 3]], helix_pose(0.0)
    found = opnp.solve(points, PINHOLE.project(pose.apply(points)), PINHOLE).candidates
    exact = found.poses.R[found.cost < 1e-20]
    assert 2 <= len(exact) <= 4
    assert rotation_error_rad(exact, np.broadcast_to(pose.R, exact.shape)).min() < 1e-12


def test_refining_reaches_the_minimum_that_the_default_solver_finds():
    camera, rng = paper_camera("equidistance"), np.random.default_rng(7)
    exact = [camera.project(random_pose(rng, PAPER_OBJECT, 80.0, 0.1).apply(PAPER_OBJECT)) for _ in range(10)]
    pixels = np.stack(exact) + 0.4 * rng.normal(size=(10, 4, 2))
    refined = opnp.solve(PAPER_OBJECT, pixels, camera, sigma_px=0.4, refine=True)
    best = eposit.solve(PAPER_OBJECT, pixels, camera, sigma_px=0.4)
    # The last Newton step of both is below 1e-9, and what remains after it the square.
    assert rotation_error_rad(refined.cam_from_obj.R, best.cam_from_obj.R).max() < 1e-11
    u, v, pose = pixels[..., 0].T, pixels[..., 1].T, best.cam_from_obj
    normal, _ = normal_equations(camera, PAPER_OBJECT, u, v, pose.R, pose.t, whitening(np.array(0.4), 4))
    np.testing.assert_allclose(refined.covariance, covariance(normal), rtol=1e-6)
    assert np.all(opnp.solve(PAPER_OBJECT, pixels, camera).reprojection_rmse_px >= refined.reprojection_rmse_px)


def test_a_batch_equals_single_calls(monkeypatch):
    monkeypatch.setattr("eposit.opnp.CHUNK", 3)
    rng = np.random.default_rng(8)
    pixels = PINHOLE.project(helix_pose(10.0).apply(PAPER_OBJECT)) + rng.normal(size=(8, 4, 2))
    pixels[5, 2, 0] = np.nan
    batch = opnp.solve(PAPER_OBJECT, pixels, PINHOLE)
    for i, single in enumerate(opnp.solve(PAPER_OBJECT, image, PINHOLE) for image in pixels):
        k = batch.candidates.count[i]
        assert (single.status, single.pairs, single.candidates.count) == (batch.status[i], batch.pairs[i], k)
        np.testing.assert_allclose(batch.cam_from_obj.R[i], single.cam_from_obj.R, rtol=0, atol=1e-12)
        np.testing.assert_allclose(batch.cam_from_obj.t[i], single.cam_from_obj.t, rtol=1e-12)
        np.testing.assert_allclose(batch.candidates.cost[i, :k], single.candidates.cost, rtol=1e-9, atol=1e-20)
        assert np.all(np.isnan(batch.candidates.poses.t[i, k:]))
    assert (batch.candidates.count[5], opnp.solve(PAPER_OBJECT, pixels[:0], PINHOLE).status.shape) == (0, (0,))


def test_failures_have_a_status_and_a_nan_pose():
    camera, pose = paper_camera("orthogonal"), helix_pose(0.0)
    pixels, line = camera.project(pose.apply(PAPER_OBJECT)), np.outer(np.arange(4.0), (100.0, 20.0, 5.0))
    broken, outside = pixels.copy(), pixels.copy()
    broken[2, 0] = np.nan
    outside[1] = [camera.cx + 1.05 * camera.fx, camera.cy]
    wide, far = paper_camera("equidistance"), Pose(pose.R, np.array([2000.0, 0.0, -50.0]))
    cases = {
        "non_finite": (PAPER_OBJECT, broken, camera),
        "outside_lens": (PAPER_OBJECT, outside, camera),
        "beyond_90_degrees": (PAPER_OBJECT, wide.project(far.apply(PAPER_OBJECT)), wide),
        "coplanar": (line, camera.project(pose.apply(line)), camera),
        "no_solution": (PAPER_OBJECT, np.full((4, 2), 700.0), camera),
    }
    for status, case in cases.items():
        solution = opnp.solve(*case)
        assert solution.status == status
        assert np.isnan(solution.cam_from_obj.t).all()
        assert (solution.pairs, solution.candidates.count) == (0, 0)
    assert opnp.solve(np.zeros((4, 3)), pixels, camera).status == "coplanar"


@pytest.mark.parametrize(
    ("points", "pixels", "options"),
    [
        (PAPER_OBJECT[:3], np.zeros((3, 2)), {}),
        (PAPER_OBJECT, np.zeros((5, 2)), {}),
        (PAPER_OBJECT * np.nan, np.zeros((4, 2)), {}),
        (PAPER_OBJECT, np.zeros((4, 2)), {"sigma_px": -1.0}),
    ],
)
def test_a_wrong_call_is_a_sentence(points, pixels, options):
    with pytest.raises(ValueError, match=r"\w+ has .*"):
        opnp.solve(points, pixels, PINHOLE, **options)
