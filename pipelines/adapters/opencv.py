"""OpenCV's solvers of the perspective-n-point problem. Lenses other than the pinhole are rectified first.

They do not weigh points and state no covariance: `sigma_px` is taken and not used.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit import Camera, Solution, Status
from eposit.arrays import Array
from pipelines.adapters.results import PoseResult, pose_result, rectified, solve_each

DIRECT_LINEAR_POINTS = 6  # what ITERATIVE needs to begin with, unless the points lie in one plane
FISHEYE_LENSES = ("equidistance", "kannala_brandt")


def sqpnp(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, *, sigma_px: ArrayLike | None = None
) -> Solution:
    """`cv2.solvePnP` with SQPNP (Terzakis and Lourakis 2020); shapes and errors as `eposit.solve`."""
    return _solve_pnp(points_in_obj, points_px, camera, cv2.SOLVEPNP_SQPNP)


def epnp(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, *, sigma_px: ArrayLike | None = None
) -> Solution:
    """`cv2.solvePnP` with EPNP (Lepetit et al. 2009), which is poor with four points; shapes as `eposit.solve`."""
    return _solve_pnp(points_in_obj, points_px, camera, cv2.SOLVEPNP_EPNP)


def iterative(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, *, sigma_px: ArrayLike | None = None
) -> Solution:
    """`cv2.solvePnP` with its default ITERATIVE: status too_few_points for 4 or 5 points that are not in a plane."""
    return _solve_pnp(points_in_obj, points_px, camera, cv2.SOLVEPNP_ITERATIVE)


def p3p(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, *, sigma_px: ArrayLike | None = None
) -> Solution:
    """`cv2.solvePnP` with P3P: four points, of which the last decides between the solutions of the others."""
    return _solve_pnp(points_in_obj, points_px, camera, cv2.SOLVEPNP_P3P)


def fisheye(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, *, sigma_px: ArrayLike | None = None
) -> Solution:
    """`cv2.fisheye.solvePnP`, whose lens is Kannala-Brandt's, or equidistance where its coefficients are 0.

    Other lenses have the status unsupported_lens, 4 or 5 points that are not in a plane too_few_points.
    """
    matrix, coefficients = camera.matrix(), np.array(camera.coefficients or (0.0,) * 4)

    def solve_one(obj: Array, image: Array) -> PoseResult:
        if camera.lens not in FISHEYE_LENSES:
            return PoseResult(Status.UNSUPPORTED_LENS)
        try:
            done, rotation, t = cv2.fisheye.solvePnP(obj, image[:, None], matrix, coefficients)
        except cv2.error:
            return _refused(obj)
        return _answer(done, rotation, t)

    # What lies at 90 degrees and beyond is refused as for the others; OpenCV is given the pixels themselves.
    return solve_each(points_in_obj, points_px, camera, solve_one, _forward)


def _forward(points_px: Array, camera: Camera) -> tuple[Array, NDArray[np.str_]]:
    return points_px, rectified(points_px, camera)[1]


def _solve_pnp(points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, flag: int) -> Solution:
    matrix = camera.matrix()

    def solve_one(obj: Array, image: Array) -> PoseResult:
        try:
            done, rotation, t = cv2.solvePnP(obj, np.ascontiguousarray(image), matrix, None, flags=flag)
        except cv2.error:
            return _refused(obj)
        return _answer(done, rotation, t)

    return solve_each(points_in_obj, points_px, camera, solve_one)


def _refused(obj: Array) -> PoseResult:
    return PoseResult(Status.TOO_FEW_POINTS if len(obj) < DIRECT_LINEAR_POINTS else Status.NO_SOLUTION)


def _answer(done: bool, rotation: ArrayLike, t: ArrayLike) -> PoseResult:
    return pose_result(cv2.Rodrigues(np.asarray(rotation))[0], t) if done else PoseResult(Status.NO_SOLUTION)
