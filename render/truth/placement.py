"""Where the camera is in a scene, at the time of each row."""

from __future__ import annotations

import numpy as np

from eposit import Pose
from eposit.arrays import Array
from render.motion import RollingPose


def poses_at(cam_from_obj: Pose, rows: Array) -> Pose:
    """(n,) poses at (n,) rows of the picture; (1,) where one pose holds for all."""
    if isinstance(cam_from_obj, RollingPose):
        return cam_from_obj.at_rows(rows)
    return Pose(cam_from_obj.R[None], cam_from_obj.t[None])


def in_world(world_from_obj: Array, points_in_obj: Array) -> Array:
    """(n, 3) points of the object frame, mm, in the scene's frame and units. world_from_obj: (4, 4)."""
    return np.stack([(world_from_obj @ np.append(point, 1.0))[:3] for point in points_in_obj])
