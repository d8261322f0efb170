"""The pose from points whose errors are shared."""

import numpy as np
import pytest

import eposit
from eposit.pose import Pose, rotation_error_vector
from eposit.refine.joint import refine_jointly
from tests.cameras import ALL_CAMERAS, random_object, random_pose

N, NOISE = 12, 0.3


def independent(covariances):
    """(n, 2, 2 n) factor of points that share nothing."""
    n, lower = len(covariances), np.linalg.cholesky(covariances)
    factor = np.zeros((n, 2, n, 2))
    factor[np.arange(n), :, np.arange(n)] = lower
    return factor.reshape(n, 2, 2 * n)


def problem(camera, seed=0):
    rng = np.random.default_rng(seed)
    points = random_object(rng, N)
    pose = random_pose(rng, points, 40.0, 0.2)
    return points, pose, camera.project(pose.apply(points)), rng


@pytest.mark.parametrize("camera", ALL_CAMERAS, ids=lambda camera: camera.lens)
def test_independent_errors_give_the_pose_of_the_solver(camera):
    points, _, pixels, rng = problem(camera)
    covariances = NOISE**2 * np.array([[1.0, 0.3], [0.3, 0.5]]) * rng.uniform(0.5, 2.0, (N, 1, 1))
    pixels = pixels + NOISE * rng.standard_normal(pixels.shape)
    expected = eposit.solve(points, pixels, camera, sigma_px=covariances)
    near = Pose(expected.cam_from_obj.R, expected.cam_from_obj.t * 1.001)
    pose, covariance = refine_jointly(points, pixels, camera, independent(covariances), near)
    # Both stop within 1e-6 of a deviation or less, and a deviation is 1e-3 of the pose.
    np.testing.assert_allclose(pose.R, expected.cam_from_obj.R, atol=1e-7)
    np.testing.assert_allclose(pose.t, expected.cam_from_obj.t, rtol=1e-7, atol=1e-6)
    # The solver's has the curvature of the cost in it: 0.5 % at this noise.
    scale = np.sqrt(np.diag(expected.covariance))
    np.testing.assert_allclose(
        covariance / np.outer(scale, scale), expected.covariance / np.outer(scale, scale), atol=0.02
    )


@pytest.mark.parametrize("rank", [9, 2 * N + 5])
def test_the_covariance_of_shared_errors_covers(rank):
    """Of fewer directions than the points have coordinates, too: they lie on a map of few parameters."""
    camera, squares = ALL_CAMERAS[0], []
    for seed in range(60):
        points, true, pixels, rng = problem(camera, seed)
        factor = NOISE * rng.standard_normal((N, 2, rank))
        if rank < 2 * N:  # a map that follows the pose
            factor[..., :6] = NOISE * slopes(camera, points, true)
        seen = pixels + factor @ rng.standard_normal(rank)
        pose, covariance = refine_jointly(points, seen, camera, factor, true)
        error = np.concatenate((rotation_error_vector(pose.R[None], true.R[None])[0], pose.t - true.t))
        squares.append(error @ np.linalg.solve(covariance, error) / 6.0)
    # 360 numbers tell a mean square of 1 to sqrt(2 / 360) = 0.075; four of those.
    assert np.mean(squares) == pytest.approx(1.0, abs=0.3)


def slopes(camera, points, pose):
    """(n, 2, 6) change of the pixels for a change of the pose that moves them by about a pixel."""
    ends = []
    for k in range(6):
        move = np.zeros(6)
        move[k] = 1e-4 if k < 3 else 1e-4 * pose.t[2]
        turned = eposit.pose.rotation_from_vector(move[:3]) @ pose.R
        change = camera.project(points @ turned.T + pose.t + move[3:]) - camera.project(pose.apply(points))
        ends.append(change / np.sqrt(np.mean(change**2)))
    return np.stack(ends, axis=-1)


def test_points_that_tell_no_pose_give_none():
    camera = ALL_CAMERAS[0]
    points, true, pixels, _ = problem(camera)
    same = np.repeat(points[:1], N, axis=0)
    assert (
        refine_jointly(
            same, np.repeat(pixels[:1], N, axis=0), camera, independent(np.repeat(np.eye(2)[None], N, 0)), true
        )
        is None
    )


def test_a_pose_without_an_image_gives_none():
    camera = ALL_CAMERAS[0]
    points, true, pixels, _ = problem(camera)
    nowhere = Pose(true.R, np.full(3, np.nan))
    assert refine_jointly(points, pixels, camera, independent(np.repeat(np.eye(2)[None], N, 0)), nowhere) is None
