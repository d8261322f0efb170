"""Which points of the target a camera sees: traced, so that what stands before the target hides them."""

from __future__ import annotations

from typing import Any  # Any: Mitsuba's scenes have no common type in its stubs

import numpy as np

from eposit import Camera, Pose
from eposit.arrays import Array, Mask
from render import backend
from render.motion import image_points
from render.truth.placement import in_world, poses_at

GAP_MM = 0.5  # before a point where its ray ends; a ray at 80 degrees from the normal is then 0.09 mm off the board


def visible_points(
    scene: Any, world_from_obj: Array, points: Array, camera: Camera, cam_from_obj: Pose, *, has_target: bool = True
) -> Mask:
    """(n,) whether points of the target lie on the picture, face the camera and have nothing before them.

    points: (n, 3) in the object frame, mm. has_target: whether the target is in the scene; if not, nothing is visible.
    """
    mi = backend.load()
    images = image_points(camera, cam_from_obj, points)
    centre = poses_at(cam_from_obj, np.nan_to_num(images[:, 1])).inverse().t
    facing = centre[:, 2] < points[:, 2]
    in_picture = camera.contains(images)
    way = points - centre
    distance = np.linalg.norm(way, axis=1)
    scale = float(np.linalg.norm(world_from_obj[:3, 0]))
    direction = (way / distance[:, None]) @ (world_from_obj[:3, :3] / scale).T
    origin = np.repeat(in_world(world_from_obj, centre), len(points) // len(centre), axis=0).astype(np.float32)
    ray = mi.Ray3f(
        mi.Point3f(*(backend.upload(part) for part in origin.T)),
        mi.Vector3f(*(backend.upload(part) for part in direction.T)),
    )
    ray.maxt = backend.upload((distance - GAP_MM) * scale)
    return facing & in_picture & ~np.array(scene.ray_test(ray)) & has_target
