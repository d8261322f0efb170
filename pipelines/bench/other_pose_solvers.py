"""OpenCV's and PoseLib's solvers as they are called bare, one image after the other.

Nothing of ours runs in a call: rays, cameras and the choice between the candidates of three points are made beforehand,
so that each has the least time that it can have.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
import poselib

from eposit.pose import rotation_error_rad
from pipelines.bench.pose_problems import Problems

Call = Callable[[int], Any]  # solves the image of this number
LEAST_ITERATIVE = 6  # points that OpenCV's ITERATIVE needs where they do not lie in one plane
LIMIT_PX = 2.0  # from which the samplers call a point wrong: five deviations of the paper's noise


def solvers(given: Problems) -> dict[str, Call]:
    """The calls by name, for all points right."""
    calls: dict[str, Call] = {"OpenCV SQPNP": _opencv(given, cv2.SOLVEPNP_SQPNP)}
    if len(given.points) >= LEAST_ITERATIVE:
        calls["OpenCV ITERATIVE"] = _opencv(given, cv2.SOLVEPNP_ITERATIVE)
    return calls | _poselib(given)


def samplers(given: Problems) -> dict[str, Call]:
    """The calls by name, for many points wrong."""
    points, images, matrix = given.points, list(given.pixels), given.camera.matrix()
    camera, limits = _poselib_camera(given), {"max_reproj_error": LIMIT_PX}
    described = {"model": "PINHOLE", "width": camera.width, "height": camera.height, "params": list(camera.params)}
    return {
        "OpenCV solvePnPRansac": lambda i: cv2.solvePnPRansac(
            points, images[i], matrix, None, reprojectionError=LIMIT_PX, iterationsCount=1000
        ),
        "PoseLib estimate_absolute_pose": lambda i: poselib.estimate_absolute_pose(
            images[i], points, described, limits, {}
        ),
    }


def _opencv(given: Problems, flag: int) -> Call:
    points, images, matrix = given.points, list(given.pixels), given.camera.matrix()
    return lambda i: cv2.solvePnP(points, images[i], matrix, None, flags=flag)


def _poselib(given: Problems) -> dict[str, Call]:
    three = list(given.three)
    first, images = np.ascontiguousarray(given.points[three]), list(given.pixels)
    rays = [np.ascontiguousarray(row) for row in given.camera.bearing(given.pixels[:, three])]
    nearest = [_nearest(poselib.p3p(ray, first), R) for ray, R in zip(rays, given.pose.R, strict=True)]
    camera = _poselib_camera(given)

    def polished(i: int) -> object:
        start = poselib.p3p(rays[i], first)[nearest[i]]
        return poselib.refine_absolute_pose(images[i], given.points, start, camera, {})

    return {"PoseLib p3p": lambda i: poselib.p3p(rays[i], first), "PoseLib p3p and polish": polished}


def _nearest(candidates: list[Any], R: np.ndarray) -> int:
    """The place of the candidate whose rotation is nearest to R."""
    return int(np.argmin([rotation_error_rad(pose.R, R) for pose in candidates]))


def _poselib_camera(given: Problems) -> Any:
    camera = given.camera
    return poselib.Camera("PINHOLE", [camera.fx, camera.fy, camera.cx, camera.cy], camera.width, camera.height)
