"""How the board moves during an exposure, and where that moves its image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from eposit.arrays import Array
from render.motion import PoseRate
from render.targets import Target
from render.targets.image_region import Region

STEP_PX = 16  # between the pixels where the motion is computed; it is bilinear between them


@dataclass(frozen=True, slots=True)
class Exposure:
    """A board that moves before a camera while its shutter is open."""

    target: Target
    camera: Camera
    cam_from_obj: Pose  # at mid-exposure
    rate: PoseRate
    seconds: float

    def displacement(self, region: Region) -> Array:
        """(rows, columns, 2) displacement of the image from the exposure's begin to its end, px.

        At every STEP_PX-th pixel of the region, from its first to beyond its last. A pixel moves as the point of the
        board's plane that it shows; beyond the board's border as the nearest point of the border. It is a central
        difference, so that the image moves as far before mid-exposure as after.
        """
        columns, rows = (np.arange(0, size + STEP_PX, STEP_PX) for size in (region.width, region.height))
        nodes = np.stack(np.meshgrid(region.x + columns, region.y + rows), axis=-1).astype(np.float64)
        points = self._board_points(nodes.reshape(-1, 2))
        poses = (self.rate.moved(self.cam_from_obj, share * self.seconds) for share in (0.5, -0.5))
        end, begin = (self.camera.project(pose.apply(points)) for pose in poses)
        return np.nan_to_num(end - begin).reshape(nodes.shape)  # what the lens does not see does not move

    def _board_points(self, pixels: Array) -> Array:
        """(n, 3) points of the board, mm, nearest to where the rays of (n, 2) pixels meet its plane."""
        obj_from_cam = self.cam_from_obj.inverse()
        rays = self.camera.bearing(pixels) @ obj_from_cam.R.T
        with np.errstate(divide="ignore", invalid="ignore"):
            length = -obj_from_cam.t[2] / rays[:, 2]
            points = obj_from_cam.t[:2] + length[:, None] * rays[:, :2]
        missed = ~(np.all(np.isfinite(points), axis=1) & (length > 0.0))
        points[missed] = self.target.board_centre[:2]
        x0, x1, y0, y1 = self.target.extent_mm
        return np.column_stack((np.clip(points, (x0, y0), (x1, y1)), np.zeros(len(points))))


def at_pixels(displacement: Array, width: int, height: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(height, width) displacements along x and along y of every pixel, bilinear between the nodes."""
    along_x, along_y = (
        _interpolated(_interpolated(nodes.T, width).T, height)
        for nodes in np.moveaxis(displacement.astype(np.float32), 2, 0)
    )
    return along_x, along_y


def _interpolated(nodes: NDArray[np.float32], size: int) -> NDArray[np.float32]:
    """Linear interpolation along the first axis from every STEP_PX-th place to all of `size`."""
    index, share = np.divmod(np.arange(size), STEP_PX)
    weight = (share / STEP_PX).astype(np.float32)[:, None]
    before, after = np.take(nodes, index, axis=0), np.take(nodes, index + 1, axis=0)
    return (before + weight * (after - before)).astype(np.float32, copy=False)
