"""Planar start: the pose of a flat object from a homography on bearings, and its mirror twin.

A flat object seen at low perspective has two poses of nearly equal cost; both are starts for the refinement.
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from eposit.shape import plane_axes


def homography_start(points_in_obj: Array, bearings: Array) -> tuple[Array, Array]:
    """Rotations (b, 3, 3) and translations (b, 3) of points that lie in or near one plane.

    points_in_obj: (n, 3) with n >= 4. bearings: (b, n, 3) unit vectors, any direction.
    Source:
        Direct linear transform of bearing x (H point) = 0 (Hartley and Zisserman, section 4.1), with bearings in
        place of image points so that rays beyond 90 degrees take part.
    """
    centroid, axes, spreads = plane_axes(points_in_obj)
    size = spreads[0] / np.sqrt(len(points_in_obj))
    flat = (points_in_obj - centroid) @ axes[:2].T / size
    plane = np.column_stack((flat, np.ones(len(flat))))
    rows = np.concatenate([_cross_rows(bearings, axis, plane) for axis in range(3)], axis=1)
    _, _, right = np.linalg.svd(rows, full_matrices=False)
    free = right[:, -1].reshape(-1, 3, 3)
    facing = np.sign(np.sum((plane @ np.swapaxes(free, 1, 2)) * bearings, axis=(1, 2)))
    homography = free * np.where(facing == 0.0, 1.0, facing)[:, None, None]
    first, second, position = np.moveaxis(homography, -1, 0)
    scale = 0.5 * (np.linalg.norm(first, axis=1) + np.linalg.norm(second, axis=1))[:, None]
    nearest = _nearest_rotation(np.stack((first, second, np.cross(first, second) / scale), axis=-1) / scale[..., None])
    axes = axes if np.linalg.det(axes) > 0.0 else axes * np.array([[1.0], [1.0], [-1.0]])
    R = nearest @ axes
    return R, position / scale * size - R @ centroid


def mirror_twin(points_in_obj: Array, R: Array, t: Array) -> tuple[Array, Array]:
    """The pose with the object's plane tilted the other way about the line of sight to its centroid.

    Under scaled orthography the twin has the same image: R -> S_v R S_n with reflections along the line of sight v
    and along the object's direction of least spread n.
    """
    centroid, axes, _ = plane_axes(points_in_obj)
    centre = R @ centroid + t
    sight = centre / np.linalg.norm(centre, axis=1, keepdims=True)
    reflect_sight = np.eye(3) - 2.0 * sight[:, :, None] * sight[:, None, :]
    reflect_normal = np.eye(3) - 2.0 * np.outer(axes[2], axes[2])
    twin = reflect_sight @ R @ reflect_normal
    return twin, centre - twin @ centroid


def _cross_rows(bearings: Array, axis: int, plane: Array) -> Array:
    """Row `axis` of bearing x (H p) = 0 for every point, as coefficients of the nine entries of H: (b, n, 9)."""
    second, third = (axis + 1) % 3, (axis + 2) % 3
    rows = np.zeros((*bearings.shape[:2], 3, 3))
    rows[:, :, third] = bearings[:, :, second, None] * plane
    rows[:, :, second] = -bearings[:, :, third, None] * plane
    return rows.reshape(*bearings.shape[:2], 9)


def _nearest_rotation(matrices: Array) -> Array:
    left, _, right = np.linalg.svd(matrices)
    sign = np.linalg.det(left @ right)
    left[:, :, 2] *= sign[:, None]
    return left @ right
