"""Truth of every pixel, by a ray through its centre: what it shows, how far away that is, and how it is turned."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any  # Any: Mitsuba's arrays have a type for each back end

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from eposit.arrays import Array
from render import backend
from render.device import DeviceScene
from render.truth.placement import in_world, poses_at

NOTHING = 0  # object id of a pixel that shows the sky, or that the lens does not see


@dataclass(frozen=True, slots=True)
class PixelTruth:
    """Truth of every pixel of a picture, (height, width)."""

    depth_mm: NDArray[np.float32]  # along the optical axis; infinite where nothing is hit
    range_mm: NDArray[np.float32]  # from the camera's centre; likewise
    normal: NDArray[np.float32]  # (height, width, 3) in camera axes, towards the camera; 0 where nothing is hit
    object_id: NDArray[np.uint32]  # 1 and more, in the order of `names`
    names: tuple[str, ...]  # of the objects


def pixel_truth(
    scene: DeviceScene, world_from_obj: Array, names: tuple[str, ...], camera: Camera, cam_from_obj: Pose
) -> PixelTruth:
    """Trace one ray through every pixel's centre; the bearing is `eposit`'s, in double precision.

    names: of the scene's objects, as in `Composition.objects`.
    """
    x, y = np.meshgrid(np.arange(camera.width, dtype=float), np.arange(camera.height, dtype=float))
    bearing = camera.bearing(np.column_stack((x.ravel(), y.ravel())))
    seen = np.all(np.isfinite(bearing), axis=1)
    bearing = np.where(seen[:, None], bearing, (0.0, 0.0, 1.0))
    distance, normal, identity = _hits(scene, world_from_obj, names, bearing, cam_from_obj, camera.height)
    hit = seen & np.isfinite(distance)
    distance, identity = np.where(hit, distance, np.inf), np.where(hit, identity, NOTHING)
    with np.errstate(invalid="ignore"):
        depth = np.where(hit, distance * bearing[:, 2], np.inf)
    normal = np.where(hit[:, None], np.where(np.sum(normal * bearing, axis=1) > 0.0, -1.0, 1.0)[:, None] * normal, 0.0)
    shape = camera.height, camera.width
    return PixelTruth(
        depth.reshape(shape).astype(np.float32),
        distance.reshape(shape).astype(np.float32),
        normal.reshape(*shape, 3).astype(np.float32),
        identity.reshape(shape).astype(np.uint32),
        names,
    )


def _hits(
    scene: Any, world_from_obj: Array, names: tuple[str, ...], bearing: Array, cam_from_obj: Pose, height: int
) -> tuple[Array, Array, NDArray[np.int64]]:
    """(n,) distance, mm; (n, 3) normal in camera axes; (n,) object ids.

    height: of the picture whose pixels the (n, 3) bearings are, row by row.
    """
    mi = backend.load()
    rotation, scale = _rotation_and_scale(world_from_obj)
    poses = poses_at(cam_from_obj, np.arange(height, dtype=np.float64))
    bands = len(poses.t)  # of pixels that are exposed at one time
    cam_from_world = poses.R @ rotation.T
    origin = np.repeat(in_world(world_from_obj, poses.inverse().t), len(bearing) // bands, axis=0).astype(np.float32)
    direction = (bearing.reshape(bands, -1, 3) @ cam_from_world).reshape(-1, 3).astype(np.float32)
    ray = mi.Ray3f(
        mi.Point3f(*(backend.upload(part) for part in origin.T)),
        mi.Vector3f(*(backend.upload(part) for part in direction.T)),
    )
    found = scene.ray_intersect(ray)
    backend.jit().eval(found)  # at once: each part of it by itself would trace all rays again
    normal = np.array(found.n).T.reshape(bands, -1, 3) @ np.swapaxes(cam_from_world, 1, 2)
    return np.array(found.t, np.float64) / scale, normal.reshape(-1, 3), _identities(scene, names, found)


def _identities(scene: Any, names: tuple[str, ...], found: Any) -> NDArray[np.int64]:
    """Number of the object that each ray hit, from 1: of the instance where it is one."""
    mi, dr = backend.load(), backend.jit()
    registered = np.array(dr.reinterpret_array(mi.UInt32, scene.shapes_dr()))
    number = {name: i for i, name in enumerate(names, 1)}
    table = np.zeros(int(registered.max(initial=0)) + 1, np.int64)
    for place, shape in zip(registered, scene.shapes(), strict=True):
        table[place] = number.get(shape.id(), NOTHING)
    shape, instance = (np.array(dr.reinterpret_array(mi.UInt32, part)) for part in (found.shape, found.instance))
    hit = np.where(instance != 0, instance, shape)
    return table[np.where(hit < len(table), hit, 0)]


def _rotation_and_scale(world_from_obj: Array) -> tuple[Array, float]:
    """A similarity's rotation and its scale."""
    scale = float(np.linalg.norm(world_from_obj[:3, 0]))
    return world_from_obj[:3, :3] / scale, scale
