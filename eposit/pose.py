"""Rigid transforms and pose errors. A transform is named target_from_source.

Euler angles are about fixed axes, R = Rz(rz) Ry(ry) Rx(rx). Errors are estimate minus truth.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask, as_numbers

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation


@dataclass(frozen=True, slots=True)
class Pose:
    """A rigid transform or a batch of them: target = R @ source + t."""

    R: Array  # (..., 3, 3) rotation matrices
    t: Array  # (..., 3) position of the source frame's origin in the target frame, any length unit

    def apply(self, points: ArrayLike) -> Array:
        """(..., n, 3) points in the source frame to (..., n, 3) in the target frame."""
        with np.errstate(all="ignore"):
            return as_numbers(points, "points") @ np.swapaxes(self.R, -1, -2) + self.t[..., None, :]

    def inverse(self) -> Pose:
        """source_from_target."""
        transposed = np.swapaxes(self.R, -1, -2)
        return Pose(transposed, -(transposed @ self.t[..., None])[..., 0])

    def __matmul__(self, other: Pose) -> Pose:
        """a_from_c = a_from_b @ b_from_c."""
        return Pose(self.R @ other.R, (self.R @ other.t[..., None])[..., 0] + self.t)

    @property
    def quaternion(self) -> Array:
        """(..., 4) unit quaternion w, x, y, z with w >= 0."""
        flat = self.R.reshape(-1, 3, 3)
        xyzw = _rotation().from_matrix(flat).as_quat(canonical=True)
        return np.roll(xyzw, 1, axis=-1).reshape(*self.R.shape[:-2], 4)

    @staticmethod
    def from_quaternion(wxyz: ArrayLike, t: ArrayLike) -> Pose:
        """From (..., 4) quaternions w, x, y, z, normalised here, and (..., 3) positions."""
        quaternion = np.asarray(wxyz, dtype=np.float64)
        matrices = _rotation().from_quat(np.roll(quaternion.reshape(-1, 4), -1, axis=-1)).as_matrix()
        return Pose(matrices.reshape(*quaternion.shape[:-1], 3, 3), np.asarray(t, dtype=np.float64))


@dataclass(frozen=True, slots=True)
class PoseBatch:
    """Poses from a start or a search; rows that failed may be NaN."""

    R: Array  # (3, 3, b)
    t: Array  # (3, b), unit of the object points
    iterations: NDArray[np.int64]  # (b,)
    converged: Mask  # (b,)


def rotation_from_euler(angles: ArrayLike) -> Array:
    """(..., 3) angles rx, ry, rz in rad to (..., 3, 3) with R = Rz Ry Rx about fixed axes."""
    array = np.asarray(angles, dtype=np.float64)
    return _rotation().from_euler("xyz", array.reshape(-1, 3)).as_matrix().reshape(*array.shape[:-1], 3, 3)


def euler_from_rotation(R: ArrayLike) -> Array:
    """(..., 3, 3) to (..., 3) angles rx, ry, rz in rad, R = Rz Ry Rx (not unique at ry = +-90 degrees)."""
    array = np.asarray(R, dtype=np.float64)
    ry = np.arctan2(-array[..., 2, 0], np.hypot(array[..., 2, 1], array[..., 2, 2]))
    rz = np.arctan2(array[..., 1, 0], array[..., 0, 0])
    rx = np.arctan2(array[..., 2, 1], array[..., 2, 2])
    return np.stack((rx, ry, rz), axis=-1)


def rotation_from_vector(vector: ArrayLike) -> Array:
    """(..., 3) rotation vectors, rad, to (..., 3, 3)."""
    array = np.asarray(vector, dtype=np.float64)
    return _rotation().from_rotvec(array.reshape(-1, 3)).as_matrix().reshape(*array.shape[:-1], 3, 3)


def rotation_error_rad(R_est: ArrayLike, R_true: ArrayLike) -> Array:
    """Geodesic angle, rad, of (..., 3, 3) rotations.

    The chord form 2 asin(|R1 - R2| / sqrt 8); the usual arccos of the trace is blind below about 1e-8 rad.
    """
    difference = np.asarray(R_est, dtype=np.float64) - np.asarray(R_true, dtype=np.float64)
    chord = np.sqrt(np.sum(difference**2, axis=(-1, -2)))
    return 2.0 * np.arcsin(np.minimum(1.0, chord / np.sqrt(8.0)))


def rotation_error_vector(R_est: ArrayLike, R_true: ArrayLike) -> Array:
    """(..., 3) rotation vector, rad, in the camera frame: R_est = exp(vector) R_true."""
    relative = np.asarray(R_est, dtype=np.float64) @ np.swapaxes(np.asarray(R_true, dtype=np.float64), -1, -2)
    finite = np.all(np.isfinite(relative), axis=(-1, -2))
    safe = np.where(finite[..., None, None], relative, np.eye(3))
    vectors = _rotation().from_matrix(safe.reshape(-1, 3, 3)).as_rotvec().reshape(*relative.shape[:-2], 3)
    return np.where(finite[..., None], vectors, np.nan)


def euler_error_rad(R_est: ArrayLike, R_true: ArrayLike) -> Array:
    """(..., 3) differences of rx, ry, rz, rad, estimate minus truth, wrapped into [-pi, pi)."""
    difference = euler_from_rotation(R_est) - euler_from_rotation(R_true)
    return (difference + np.pi) % (2.0 * np.pi) - np.pi


def tilt_rad(R: ArrayLike) -> Array:
    """(..., 3, 3) cam_from_obj to the angle, rad, between the object's z axis and the optical axis."""
    array = np.asarray(R, dtype=np.float64)
    return np.arctan2(np.hypot(array[..., 0, 2], array[..., 1, 2]), array[..., 2, 2])


def _rotation() -> type[Rotation]:
    """SciPy's class, loaded by the first who needs it: it takes most of the time that an import of eposit would."""
    from scipy.spatial.transform import Rotation

    return Rotation
