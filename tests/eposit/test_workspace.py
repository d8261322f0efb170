"""Workspaces are used again: no call may see or change what another one left."""

import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import eposit
from eposit.workspace import LARGEST_COPY, give_back, lend

CAMERAS = (
    eposit.Camera(lens="perspective", fx=800.0, fy=805.0, cx=640.0, cy=480.0, width=1280, height=960),
    eposit.Camera(lens="equisolid", fx=500.0, fy=501.0, cx=640.0, cy=480.0, width=1280, height=960),
)


def _problem(i, n):
    """(object points, image points, camera) of the i-th problem."""
    rng, camera = np.random.default_rng(i), CAMERAS[i % 2]
    points = rng.uniform(-200.0, 200.0, (n, 3))
    return points, camera.project(points + (50.0, -30.0, 1500.0)) + rng.normal(0.0, 0.3, (n, 2)), camera


def _numbers(solution):
    return np.concatenate([solution.cam_from_obj.R.ravel(), solution.cam_from_obj.t, solution.covariance.ravel()])


def test_a_solution_stays_when_the_next_one_is_made():
    first = eposit.solve(*_problem(0, 10))
    kept = _numbers(first).copy()
    for i in range(1, 30):
        eposit.solve(*_problem(i, 4 + i % 7))
    np.testing.assert_array_equal(_numbers(first), kept)
    assert first.inliers.all()
    first.inliers[:] = False
    assert eposit.solve(*_problem(0, 10)).inliers.all()


def test_objects_and_cameras_may_follow_each_other_in_any_order():
    problems = [_problem(i, n) for i, n in enumerate((4, 54, 5, 700, 4, 2000, 8, 54))]
    forward = [_numbers(eposit.solve(*problem)) for problem in problems]
    backward = [_numbers(eposit.solve(*problem)) for problem in reversed(problems)][::-1]
    np.testing.assert_array_equal(forward, backward)
    assert np.all(np.isfinite(forward))


def test_threads_give_the_bits_of_one():
    problems = [_problem(i, 4 + i % 9) for i in range(400)]
    alone = [_numbers(eposit.solve(*problem)) for problem in problems]
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)  # threads change as often as they can
    try:
        with ThreadPoolExecutor(8) as pool:
            together = list(pool.map(lambda problem: _numbers(eposit.solve(*problem)), problems))
    finally:
        sys.setswitchinterval(before)
    np.testing.assert_array_equal(together, alone)


def test_a_workspace_is_lent_to_one_at_a_time():
    one, other = lend(CAMERAS[0], 4), lend(CAMERAS[0], 4)
    assert one.address != other.address
    give_back(one)
    give_back(other)


@pytest.mark.parametrize("n", [8, LARGEST_COPY])
def test_arrays_may_be_read_only(n):
    points, pixels, camera = _problem(3, n)
    expected = _numbers(eposit.solve(points, pixels, camera))
    points.setflags(write=False)
    pixels.setflags(write=False)
    np.testing.assert_array_equal(_numbers(eposit.solve(points, pixels, camera)), expected)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_coordinate_that_is_not_finite_is_refused(value):
    points, pixels, camera = _problem(0, 6)
    points[3, 1] = value
    with pytest.raises(ValueError, match="NaN or infinite"):
        eposit.solve(points, pixels, camera)


def test_coordinates_whose_squares_overflow_are_finite():
    points, pixels, camera = _problem(0, 6)
    with np.errstate(all="raise"):
        assert eposit.solve(points * 1e160, pixels, camera).status in {"ok", "not_converged"}
