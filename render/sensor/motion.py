"""How the board moves during an exposure, and where that moves its image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from eposit.arrays import Array
from eposit.pose import rotation_from_vector
from render.region import Region
from render.targets.chessboard import Target

STEP_PX = 16  # between the pixels where the motion is computed; it is bilinear between them


@dataclass(frozen=True, slots=True)
class Rate:
    """Time derivative of a pose cam_from_obj."""

    velocity_mm_per_s: Array  # (3,) of the object frame's origin, camera axes
    turn_rad_per_s: Array  # (3,) rotation vector per second, camera axes

    def moved(self, pose: Pose, seconds: float) -> Pose:
        """The pose after a time of even motion."""
        turn = rotation_from_vector(self.turn_rad_per_s * seconds)
        return Pose(turn @ pose.R, pose.t + self.velocity_mm_per_s * seconds)

    @staticmethod
    def about(pose: Pose, point_in_obj: Array, velocity_mm_per_s: Array, turn_rad_per_s: Array) -> Rate:
        """The rate at which a point of the object moves with a velocity while the object turns about it."""
        arm = -(pose.R @ point_in_obj)
        return Rate(velocity_mm_per_s + np.cross(turn_rad_per_s, arm), turn_rad_per_s)


def way_at_nodes(
    target: Target, camera: Camera, cam_from_obj: Pose, rate: Rate, seconds: float, region: Region
) -> Array:
    """(rows, columns, 2) way in px that pixels go during an exposure, mid-exposure at its middle.

    Every STEP_PX-th pixel of the region, from its first to beyond its last. A pixel moves as the point of the board's
    plane that it shows; beyond the board's border as the nearest point of the border. It is a central difference, so
    that the way there and the way back are equally long.
    """
    x, y, width, height = region
    columns, rows = (np.arange(0, size + STEP_PX, STEP_PX) for size in (width, height))
    nodes = np.stack(np.meshgrid(x + columns, y + rows), axis=-1).astype(np.float64)
    points = _on_board(target, camera, cam_from_obj, nodes.reshape(-1, 2))
    ends = [camera.project(rate.moved(cam_from_obj, s * seconds).apply(points)) for s in (0.5, -0.5)]
    return np.nan_to_num(ends[0] - ends[1]).reshape(nodes.shape)  # what the lens does not see does not move


def at_pixels(nodes: Array, width: int, height: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(height, width) ways along x and along y at every pixel, bilinear between the nodes."""
    along_x, along_y = (
        _between(_between(way.T, width).T, height) for way in np.moveaxis(nodes.astype(np.float32), 2, 0)
    )
    return along_x, along_y


def _on_board(target: Target, camera: Camera, cam_from_obj: Pose, pixels: Array) -> Array:
    """(n, 3) points of the board, mm, nearest to where the rays of (n, 2) pixels meet its plane."""
    obj_from_cam = cam_from_obj.inverse()
    rays = camera.bearing(pixels) @ obj_from_cam.R.T
    with np.errstate(divide="ignore", invalid="ignore"):
        way = -obj_from_cam.t[2] / rays[:, 2]
        points = obj_from_cam.t[:2] + way[:, None] * rays[:, :2]
    missed = ~(np.all(np.isfinite(points), axis=1) & (way > 0.0))
    points[missed] = target.board_centre[:2]
    x0, x1, y0, y1 = target.extent_mm
    return np.column_stack((np.clip(points, (x0, y0), (x1, y1)), np.zeros(len(points))))


def _between(nodes: NDArray[np.float32], size: int) -> NDArray[np.float32]:
    """Linear interpolation along the first axis from every STEP_PX-th place to all of `size`."""
    index, share = np.divmod(np.arange(size), STEP_PX)
    weight = (share / STEP_PX).astype(np.float32)[:, None]
    before, after = np.take(nodes, index, axis=0), np.take(nodes, index + 1, axis=0)
    return (before + weight * (after - before)).astype(np.float32, copy=False)
