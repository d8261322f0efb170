"""Problems that the parts share: the paper's object, cameras and helix, poses at a field angle, bounds and rates."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from datasets.recipe.camera_sets import set_cameras
from datasets.trajectories.helix import Helix
from eposit import Camera, Pose, Solution
from eposit.arrays import Array, Mask
from eposit.pose import rotation_error_vector, rotation_from_vector
from eposit.refine.weights import covariance, normal_equations, whitening
from render.targets.chessboard import Chessboard

OBJECT = np.array([(0.0, 0.0, 0.0), (200.0, 0.0, 0.0), (0.0, 200.0, 0.0), (0.0, 0.0, -50.0)])  # the paper's, mm
SIGMA_PX = 0.4  # the paper's noise
EXACT_RAD = 1e-6  # rotation error below which a pose from exact points is the true one
DISTANCE_MM = 2000.0
SIDE_MM = 200.0  # of the cube of more points
CLOUD_SEED = 55
NORMAL_MEDIAN = float(norm.ppf(0.75))  # of the absolute value, over the standard deviation


def camera_with(lens: str) -> Camera:
    """The paper's true camera: pinhole intrinsics for the perspective lens, fish-eye intrinsics for the others."""
    return set_cameras("paper")[lens].true_camera()


def nominal_camera_with(lens: str) -> Camera:
    """The same as a user without calibration assumes it: nominal focal length and image centre."""
    return set_cameras("paper")[lens].nominal_camera()


def fisheye_with(lens: str) -> Camera:
    """The paper's fish-eye intrinsics with any lens."""
    return camera_with("equidistance").replace(lens=lens)


def cloud(n: int) -> Array:
    """(n, 3) mm: the paper's four points, then the same others each time, anywhere in the cube of 200 mm at M0."""
    rng = np.random.default_rng(CLOUD_SEED)
    return np.vstack((OBJECT, rng.uniform((0.0, 0.0, -SIDE_MM), (SIDE_MM, SIDE_MM, 0.0), (max(0, n - 4), 3))))[:n]


def stacked(poses: list[Pose]) -> Pose:
    """Poses as a batch."""
    return Pose(np.stack([pose.R for pose in poses]), np.stack([pose.t for pose in poses]))


def helix(step: float = 1.0) -> Pose:
    """The paper's 361 poses of M0 on its helix, or every `step` seconds."""
    return poses_on(Helix(point="origin", step=step))


@functools.lru_cache(maxsize=8)  # each part and claim begins with them
def poses_on(path: Helix) -> Pose:
    """A helix's poses of the paper's board, one for each of its times; nobody may write into them."""
    board = Chessboard()
    poses = stacked([path.cam_from_obj(time, board) for time in path.times()])
    for values in (poses.R, poses.t):
        values.flags.writeable = False
    return poses


def taken(pose: Pose, order: NDArray[np.intp]) -> Pose:
    """The poses of these numbers."""
    return Pose(pose.R[order], pose.t[order])


def repeated(pose: Pose, draws: int) -> Pose:
    """Each pose `draws` times in a row."""
    return taken(pose, np.repeat(np.arange(len(pose.t)), draws))


def at_field_angle(degrees: float, count: int, seed: int) -> Pose:
    """Random rotations, with M0 at 2 m and at this angle from the optical axis, in random directions about it."""
    return at_angles(np.full(count, degrees), DISTANCE_MM, np.random.default_rng(seed))


def at_angles(degrees: Array, distance_mm: float, rng: np.random.Generator) -> Pose:
    """The same with an angle for each pose, (b,)."""
    count = len(degrees)
    w, x, y, z = (rng.standard_normal(count) for _ in range(4))
    theta, phi = np.deg2rad(degrees), rng.uniform(0.0, 2.0 * np.pi, count)
    ray = np.stack((np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)), axis=1)
    return Pose.from_quaternion(np.stack((w, x, y, z), axis=1), distance_mm * ray)


def turned(pose: Pose, degrees: float, seed: int) -> Pose:
    """The camera turned about a random axis across the optical axis, so that what was on the axis is off it."""
    phi = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, len(pose.t))
    axis = np.stack((np.cos(phi), np.sin(phi), np.zeros_like(phi)), axis=1)
    turn = rotation_from_vector(np.deg2rad(degrees) * axis)
    return Pose(turn, np.zeros_like(pose.t)) @ pose


def noisy(camera: Camera, points_in_obj: Array, pose: Pose, seed: int, sigma_px: float = SIGMA_PX) -> Array:
    """(b, n, 2) image points with noise, px."""
    exact = camera.project(pose.apply(points_in_obj))
    return exact + sigma_px * np.random.default_rng(seed).standard_normal(exact.shape)


def errors_of(solution: Solution, pose: Pose) -> Array:
    """(b, 6) rotation vector on the left in the camera frame, rad, then t, mm: estimate minus truth."""
    found = solution.cam_from_obj
    return np.concatenate((rotation_error_vector(found.R, pose.R), found.t - pose.t), axis=-1)


def information(
    camera: Camera, points_in_obj: Array, pose: Pose, sigma_px: float = SIGMA_PX, right: Mask | None = None
) -> Array:
    """(b, 6, 6) information at the truth; of the `right` points (b, n) only, if given."""
    u, v = np.moveaxis(camera.project(pose.apply(points_in_obj)), -1, 0)
    if right is None:
        weights = whitening(np.array(sigma_px), len(points_in_obj))
        return normal_equations(camera, points_in_obj, u.T, v.T, pose.R, pose.t, weights)[0]
    total, weights = np.zeros((len(pose.t), 6, 6)), whitening(np.array(sigma_px), 1)
    for i in range(len(points_in_obj)):
        one = slice(i, i + 1)
        part, _ = normal_equations(camera, points_in_obj[one], u.T[one], v.T[one], pose.R, pose.t, weights)
        total += np.where(right[:, i, None, None], part, 0.0)
    return total


def bounds(normal: Array) -> Array:
    """(b, 6) Cramer-Rao standard deviations, rad and mm."""
    return np.sqrt(np.diagonal(covariance(normal), axis1=1, axis2=2))
