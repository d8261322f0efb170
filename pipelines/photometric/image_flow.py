"""Where pixels look on the board, and how the board's image moves with its pose."""

from __future__ import annotations

import numpy as np

from eposit import Camera, Pose
from eposit.arrays import Array, Mask
from render.targets.image_region import Region

POSE = 6  # parameters of a change of pose: a rotation vector on the left in the camera frame, rad, then t


def plane_points(camera: Camera, cam_from_obj: Pose, region: Region, z: float = 0.0) -> tuple[Array, Mask]:
    """(n, 3) where the rays of a region's pixels meet the plane at z, unit of t; (n,) whether they do.

    Pixels row by row; x and y are 0 where a ray does not meet the plane.
    """
    y, x = np.mgrid[region.y : region.y + region.height, region.x : region.x + region.width]
    rays = camera.bearing(np.column_stack((x.ravel(), y.ravel())))
    obj_from_cam = cam_from_obj.inverse()
    direction = rays @ obj_from_cam.R.T
    with np.errstate(divide="ignore", invalid="ignore"):
        length = (z - obj_from_cam.t[2]) / direction[:, 2]
        points = obj_from_cam.t[:2] + length[:, None] * direction[:, :2]
    met = np.all(np.isfinite(points), axis=1) & (length > 0.0)
    return np.column_stack((np.where(met[:, None], points, 0.0), np.full(len(points), z))), met


def image_flow(camera: Camera, cam_from_obj: Pose, points: Array) -> Array:
    """(2, 6, n) derivatives of the images of (n, 3) points, px, with respect to a change of pose.

    A change is a rotation vector w and a translation d: R becomes exp(w) R and t becomes t + d.
    """
    turned = cam_from_obj.R @ points.T
    by_place = projection_slopes(camera, turned + cam_from_obj.t[:, None])
    flow = np.empty((2, POSE, points.shape[0]))
    for axis in range(2):
        flow[axis, :3] = np.cross(turned, by_place[axis], axis=0)
        flow[axis, 3:] = by_place[axis]
    return flow


def projection_slopes(camera: Camera, points_in_cam: Array) -> Array:
    """(2, 3, n) derivatives of the image, px, with respect to (3, n) points in the camera frame.

    The image is f rho(theta) (ex, ey) with (ex, ey) the direction away from the axis. Along it rho changes by its
    slope, across it the image turns with the point.
    """
    x, y, z = points_in_cam
    side = np.hypot(x, y)
    theta = np.arctan2(side, z)
    rho, slope = camera.law.rho(theta), camera.law.slope(theta)
    off_axis = side > 0.0
    inverse = np.where(off_axis, 1.0 / np.where(off_axis, side, 1.0), 0.0)
    across = np.where(off_axis, rho * inverse, slope / np.abs(z))
    square = side * side + z * z
    ex, ey = x * inverse, y * inverse
    beyond, axial = slope * z / square - across, -slope * side / square
    along_x = camera.fx * np.stack((across + beyond * ex * ex, beyond * ex * ey, axial * ex))
    along_y = camera.fy * np.stack((beyond * ex * ey, across + beyond * ey * ey, axial * ey))
    return np.stack((along_x, along_y))
