"""How a pose changes: its rate, and what a rolling shutter makes of it, by which every row has a pose of its own."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from eposit import Camera, Pose
from eposit.arrays import Array
from eposit.pose import rotation_from_vector

MOST_STEPS = 100  # of the search for a point's row; at hand-held speeds each leaves a tenth of the error
ROW_ACCURACY_PX = 1e-9
FARTHEST_HEIGHTS = 10.0  # heights of the picture; farther out no row is looked for


@dataclass(frozen=True, slots=True)
class PoseRate:
    """Time derivative of a pose cam_from_obj."""

    velocity_mm_per_s: Array  # (3,) of the object frame's origin, camera axes
    turn_rad_per_s: Array  # (3,) rotation vector per second, camera axes

    def moved(self, pose: Pose, seconds: ArrayLike) -> Pose:
        """The pose after a time of even motion, or the poses after (n,) times."""
        time = np.asarray(seconds, np.float64)[..., None]
        turn = rotation_from_vector(self.turn_rad_per_s * time)
        return Pose(turn @ pose.R, pose.t + self.velocity_mm_per_s * time)

    @staticmethod
    def about(pose: Pose, point_in_obj: Array, velocity_mm_per_s: Array, turn_rad_per_s: Array) -> PoseRate:
        """The rate at which a point of the object moves with a velocity while the object turns about it."""
        arm = -(pose.R @ point_in_obj)
        return PoseRate(velocity_mm_per_s + np.cross(turn_rad_per_s, arm), turn_rad_per_s)


@dataclass(frozen=True, slots=True)
class RollingPose(Pose):
    """A pose that changes from row to row of a picture; R and t are those of the middle of its height.

    Row y is exposed about the time (y - (height - 1) / 2) line_time_s, and the pixels of a row at the same time. What
    takes this for a plain pose treats the picture as if a global shutter had taken it at the middle row's time.
    """

    rate: PoseRate
    line_time_s: float  # from one row to the next
    height: int  # rows of the picture

    def at_rows(self, rows: ArrayLike) -> Pose:
        """(n,) poses at (n,) rows, which need not be whole."""
        return self.rate.moved(self, (np.asarray(rows, np.float64) - 0.5 * (self.height - 1)) * self.line_time_s)


def rolling_pose(cam_from_obj: Pose, rate: PoseRate, line_time_s: float, height: int) -> Pose:
    """The pose under a rolling shutter; with a line time of 0 s the pose itself."""
    if line_time_s == 0.0:
        return cam_from_obj
    return RollingPose(cam_from_obj.R, cam_from_obj.t, rate, line_time_s, height)


def points_in_cam(camera: Camera, cam_from_obj: Pose, points_in_obj: Array) -> Array:
    """(n, 3) points of the object in the camera frame, each at the time at which its row is exposed.

    That row is where the point is seen at that time: found by going back and forth between both. Points that have no
    image keep their place at the middle row's time, and so do those that move as fast as the rows are read, so that
    there is no one row: NaN for these.
    """
    middle = cam_from_obj.apply(points_in_obj)
    if not isinstance(cam_from_obj, RollingPose):
        return middle
    row = camera.project(middle)[:, 1]
    seen = np.isfinite(row)
    if seen.any():
        middle[seen] = _in_their_rows(camera, cam_from_obj, points_in_obj[seen], row[seen])
    return middle


def _in_their_rows(camera: Camera, pose: RollingPose, points_in_obj: Array, rows: Array) -> Array:
    """(n, 3) points of the object in the camera frame, NaN where no row is found. rows: (n,) where they may be seen."""
    limit = FARTHEST_HEIGHTS * pose.height
    found, settled = np.empty_like(points_in_obj), np.zeros(len(rows), bool)
    for _ in range(MOST_STEPS):
        found = pose.at_rows(rows).apply(points_in_obj[:, None])[:, 0]
        projected = camera.project(found)[:, 1]
        settled = np.abs(projected - rows) < ROW_ACCURACY_PX
        if settled.all():
            break
        rows = np.where(np.isfinite(projected), np.clip(projected, -limit, limit), rows)
    return np.where(settled[:, None], found, np.nan)


def image_points(camera: Camera, cam_from_obj: Pose, points_in_obj: Array) -> Array:
    """(n, 2) px where a camera sees points of the object, each at its row's time; NaN rows where it does not."""
    return camera.project(points_in_cam(camera, cam_from_obj, points_in_obj))
