"""PoseLib's minimal solvers. They do not weigh points and state no covariance: `sigma_px` is taken and not used."""

from __future__ import annotations

import numpy as np
import poselib
from numpy.typing import ArrayLike

from eposit import Camera, Solution, Status
from eposit.arrays import Array
from pipelines.adapters.results import PoseResult, pose_result, rays, solve_each


def p3p(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, *, sigma_px: ArrayLike | None = None
) -> Solution:
    """`poselib.p3p` on the first three rays, of any lens; the fourth point decides. Shapes as `eposit.solve`."""

    def solve_one(obj: Array, bearings: Array) -> PoseResult:
        best, least = PoseResult(Status.NO_SOLUTION), np.inf
        for pose in poselib.p3p(bearings[:3], obj[:3]):
            last = pose.R @ obj[3] + pose.t
            miss = float(np.linalg.norm(last / np.linalg.norm(last) - bearings[3]))
            if miss < least:
                best, least = pose_result(pose.R, pose.t), miss
        return best

    return solve_each(points_in_obj, points_px, camera, solve_one, rays)


def p4pf(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, *, sigma_px: ArrayLike | None = None
) -> Solution:
    """`poselib.p4pf` on four points: the focal length is estimated, not taken from the camera.

    The ratio of fx and fy and the principal point are the camera's; a lens other than the pinhole is rectified with
    the camera's focal length first. Of several solutions with all points in front, the one of least reprojection
    error is taken.
    """
    matrix = camera.matrix()

    def solve_one(obj: Array, image: Array) -> PoseResult:
        plane = (image - matrix[:2, 2]) / matrix[[0, 1], [0, 1]]
        # The solver loses its digits, and one solution in three, on numbers far from 1.
        moved = obj - obj[0]
        size = np.abs(moved).max()
        plane, small = plane / np.abs(plane).max(), moved / size
        best, least = PoseResult(Status.NO_SOLUTION), np.inf
        for pose, focal in zip(*poselib.p4pf(plane, small, False), strict=True):
            in_cam = small @ pose.R.T + pose.t
            if not (focal > 0.0 and np.all(in_cam[:, 2] > 0.0)):
                continue
            miss = float(np.sum((focal * in_cam[:, :2] / in_cam[:, 2:] - plane) ** 2))
            if miss < least:
                best, least = pose_result(pose.R, pose.t * size - pose.R @ obj[0]), miss
        return best

    return solve_each(points_in_obj, points_px, camera, solve_one)
