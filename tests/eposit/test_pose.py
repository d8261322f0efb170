"""Transforms and the error metric, at the scale that we report."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from eposit import Pose
from eposit.pose import (
    euler_error_rad,
    euler_from_rotation,
    rotation_error_rad,
    rotation_error_vector,
    rotation_from_euler,
    rotation_from_vector,
    tilt_rad,
)

angles = st.floats(-1.4, 1.4)


@pytest.mark.parametrize("angle", [1e-12, 1e-9, 1e-6, 1e-3, 1.0, 3.0])
def test_rotation_error_returns_the_angle(angle):
    turned = Rotation.from_rotvec([0.0, 0.0, angle]).as_matrix()
    # The matrix holds sin(angle) to 1e-16 absolute, so 1e-12 is good to 1e-4 of itself.
    assert rotation_error_rad(turned, np.eye(3)) == pytest.approx(angle, rel=3e-4)


@settings(deadline=None)  # a busy machine is slow
@given(angles, angles, angles)
def test_euler_order_is_rz_ry_rx(rx, ry, rz):
    cx, sx, cy, sy, cz, sz = np.cos(rx), np.sin(rx), np.cos(ry), np.sin(ry), np.cos(rz), np.sin(rz)
    expected = (
        np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
        @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
        @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    )
    R = rotation_from_euler([rx, ry, rz])
    np.testing.assert_allclose(R, expected, rtol=0, atol=1e-15)
    # ry up to 1.4 rad: cos(ry) = 0.17 divides the rounding of the other two.
    np.testing.assert_allclose(euler_from_rotation(R), [rx, ry, rz], rtol=0, atol=1e-14)


def test_euler_error_wraps():
    before, after = rotation_from_euler([0, 0, np.pi - 0.01]), rotation_from_euler([0, 0, -np.pi + 0.01])
    np.testing.assert_allclose(euler_error_rad(after, before), [0, 0, 0.02], atol=1e-12)


def test_error_vector_is_applied_on_the_left():
    R = rotation_from_euler([0.3, -0.5, 1.0])
    vector = np.array([0.01, -0.02, 0.03])
    np.testing.assert_allclose(rotation_error_vector(rotation_from_vector(vector) @ R, R), vector, atol=1e-14)


def test_pose_algebra_and_quaternion():
    rng = np.random.default_rng(3)
    a = Pose(Rotation.random(5, rng).as_matrix(), rng.normal(size=(5, 3)))
    b = Pose(Rotation.random(5, rng).as_matrix(), rng.normal(size=(5, 3)))
    points = rng.normal(size=(5, 7, 3))
    np.testing.assert_allclose((a @ b).apply(points), a.apply(b.apply(points)), atol=1e-14)
    np.testing.assert_allclose(a.inverse().apply(a.apply(points)), points, atol=1e-14)
    assert np.all(a.quaternion[:, 0] >= 0)
    np.testing.assert_allclose(Pose.from_quaternion(a.quaternion, a.t).R, a.R, atol=1e-15)


def test_tilt_of_the_helix():
    # At the helix's start all three angles are 20 degrees: cos(tilt) = cos(20)^2.
    R = rotation_from_euler(np.deg2rad([20.0, 20.0, 20.0]))
    assert tilt_rad(R) == pytest.approx(np.arccos(np.cos(np.deg2rad(20.0)) ** 2), abs=1e-14)
