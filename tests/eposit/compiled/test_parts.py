"""The compiled parts of the solver against plain NumPy: derivatives, systems of six, roots, poses of triangles."""

import numpy as np
import pytest

from eposit.compiled import layout
from eposit.compiled.linear6 import factorise, inverse, solve
from eposit.compiled.model import cost_at, derivatives
from eposit.compiled.p3p import p3p
from eposit.compiled.planar import planar_poses
from eposit.compiled.quartic import quartic_roots
from eposit.pose import rotation_error_rad, rotation_from_vector
from tests.cameras import ALL_CAMERAS, paper_camera, random_object, random_pose
from tests.eposit.compiled.workspace import POSE, call, get_pose, problem, put_pose

FULL = np.broadcast_to([[0.3, 0.1], [0.1, 0.2]], (5, 2, 2))


@pytest.mark.parametrize("near_axis", [False, True])
@pytest.mark.parametrize("camera", ALL_CAMERAS, ids=lambda camera: camera.lens)
def test_gradient_and_hessian_are_those_of_differences_of_the_cost(camera, near_axis):
    """At residuals of 20 px, so that the second derivatives of the projection count."""
    rng = np.random.default_rng(1)
    points = random_object(rng, 5)
    pose = random_pose(rng, points, 60.0, 0.2)
    if near_axis:  # one point 1e-4 rad off the axis: there the polynomial lens has a series
        pose.t[:2] = -(pose.R @ points[1])[:2] + 1e-4 * pose.t[2]
    w = problem(camera, points, camera.project(pose.apply(points)) + 20.0 * rng.normal(size=(5, 2)), FULL)
    put_pose(w, pose)
    cost = call(derivatives, w, 5, POSE, 1.0, layout.GRADIENT, layout.HESSIAN)
    gradient = w[layout.GRADIENT : layout.GRADIENT + 6].copy()
    upper = np.triu(w[layout.HESSIAN : layout.HESSIAN + 36].reshape(6, 6))
    hessian = upper + np.triu(upper, 1).T

    def half_cost(move):
        moved = w.copy()
        moved[POSE : POSE + 9] = (rotation_from_vector(move[:3]) @ pose.R).ravel()
        moved[POSE + 9 : POSE + 12] += move[3:]
        return 0.5 * call(cost_at, moved, 5, POSE)

    assert half_cost(np.zeros(6)) == pytest.approx(0.5 * cost, rel=1e-14)
    step, scale = 1e-4 * np.eye(6), np.sqrt(np.abs(np.diag(hessian)))
    slopes = [(half_cost(h) - half_cost(-h)) / 2e-4 for h in step]
    bends = [
        [(half_cost(g + h) - half_cost(g - h) - half_cost(h - g) + half_cost(-g - h)) / 4e-8 for g in step]
        for h in step
    ]
    # Central differences of 1e-4 leave 1e-8 of the third and fourth derivatives, rounding 1e-16 / 1e-8 of the cost.
    np.testing.assert_allclose(gradient / scale, slopes / scale, atol=1e-6 * np.abs(slopes / scale).max())
    np.testing.assert_allclose(hessian / np.outer(scale, scale), bends / np.outer(scale, scale), atol=1e-4)


def test_systems_of_six_are_those_of_lapack():
    rng = np.random.default_rng(22)
    H, L, g, x, out = 0, 36, 78, 84, 90
    for _ in range(20):
        jacobian = rng.normal(size=(9, 6)) * np.array([1e3, 1e3, 1e3, 1.0, 1.0, 1e-3])  # units differ as in a pose
        normal, w = jacobian.T @ jacobian, np.zeros(126)
        w[:36], w[g : g + 6] = np.triu(normal).ravel(), rng.normal(size=6)
        assert call(factorise, w, H, 0.0, L) == 6
        call(solve, w, L, g, x)
        call(inverse, w, L, out)
        scale = np.sqrt(np.diag(normal))
        # Conditions up to 1e4 after scaling: 1e-12 of 16 digits.
        expected = -np.linalg.solve(normal / np.outer(scale, scale), w[g : g + 6] / scale)
        np.testing.assert_allclose(w[x : x + 6] * scale, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
        np.testing.assert_allclose(w[out : out + 36].reshape(6, 6) @ normal, np.eye(6), atol=1e-6)


def test_a_matrix_that_is_not_positive_gives_a_direction_of_descent():
    w = np.zeros(90)
    w[:36] = np.diag([1.0, 2.0, -3.0, 1.0, 1.0, 1.0]).ravel()
    w[78:84] = 1.0
    assert call(factorise, w, 0, 0.0, 36) == 2
    call(solve, w, 36, 78, 84)
    np.testing.assert_allclose(w[84:90], [-1.0, -0.5, -1.0 / 3.0, -1.0, -1.0, -1.0])


def test_roots_of_very_different_size_keep_their_digits():
    """The shift by a quarter of the largest root would leave a root of 1e-4 four digits less than this."""
    rng = np.random.default_rng(31)
    for _ in range(300):
        roots = np.sort(np.array([1e-4, 1e-2, 1.0, 1e3]) * rng.uniform(1.0, 2.0, 4))
        w = np.zeros(9)
        w[4:] = np.poly(roots)[::-1]
        call(quartic_roots, w, 0)
        # Coefficients of full precision state such roots to 1e-13 or so.
        np.testing.assert_allclose(np.sort(w[:4]), roots, rtol=1e-11)


@pytest.mark.parametrize("camera", ALL_CAMERAS, ids=lambda camera: camera.lens)
def test_one_pose_of_the_triangle_is_the_true_one(camera):
    rng, errors = np.random.default_rng(3), []
    for _ in range(40):
        points = random_object(rng, 5)
        pose = random_pose(rng, points, 60.0, 0.2)
        w = problem(camera, points, camera.project(pose.apply(points)))
        found = [get_pose(w, POSE + 12 * i) for i in range(call(p3p, w, 5, POSE))]
        errors.append(min(rotation_error_rad(one.R, pose.R) for one in found))
    # Where two poses nearly coincide a triangle tells its pose to the root of rounding.
    assert np.median(errors) < 1e-10
    assert np.max(errors) < 1e-5


@pytest.mark.parametrize("n", [4, 9])
def test_the_first_planar_pose_is_the_true_one(n):
    rng, camera = np.random.default_rng(4), paper_camera("equisolid")
    for _ in range(20):
        points = random_object(rng, n) * (1.0, 1.0, 0.0) @ rotation_from_vector(rng.normal(size=3)).T
        pose = random_pose(rng, points, 60.0, 0.3)
        w = problem(camera, points, camera.project(pose.apply(points)))
        assert call(planar_poses, w, n, POSE) == 2
        # The normal matrix of the homography squares its condition; a start needs no more.
        assert rotation_error_rad(get_pose(w).R, pose.R) < 1e-3
