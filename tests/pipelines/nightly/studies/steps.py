"""What a solver would return that stops some steps before the end: Gauss-Newton's way to the pose."""

from __future__ import annotations

import dataclasses

import numpy as np

import eposit
from eposit import Pose
from eposit.pose import rotation_from_vector
from eposit.refine.weights import normal_equations, whitening

ENDED = 1e-12  # rad and relative translation of a step that changes nothing any more
MOST = 50


def earlier(solution, count, points_in_obj, points_px, camera, sigma_px):
    """A solution of one image, (1, n, 2) px, with the pose of `count` steps before its last, or the first one.

    The way begins at the best start and is taken with J^T J, as ours is while its steps are long.
    """
    start = eposit.solve(points_in_obj, points_px, camera, sigma_px=sigma_px, refine=False).cam_from_obj
    way = [start]
    weights = whitening(None if sigma_px is None else np.asarray(sigma_px, float), len(points_in_obj))
    for _ in range(MOST):
        following, size = _step(way[-1], points_in_obj, points_px, camera, weights)
        if not size > ENDED:
            break
        way.append(following)
    pose = way[max(0, len(way) - 1 - count)]
    return dataclasses.replace(solution, cam_from_obj=pose)


def _step(pose, points_in_obj, points_px, camera, weights):
    u, v = points_px[..., 0].T, points_px[..., 1].T
    normal, gradient = normal_equations(camera, points_in_obj, u, v, pose.R, pose.t, weights)
    move = -np.linalg.solve(normal, gradient[..., None])[..., 0]
    size = max(np.linalg.norm(move[0, :3]), np.linalg.norm(move[0, 3:]) / np.linalg.norm(pose.t[0]))
    return Pose(rotation_from_vector(move[:, :3]) @ pose.R, pose.t + move[:, 3:]), size
