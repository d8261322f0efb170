"""`photometric`: the pose at which the closed form's picture is likest to the pixels, from our corner-based pose.

A corner fit uses the pixels around corners and lets each corner lie anywhere. Here all pixels of all edges speak for
six numbers. What the solver knows is camera and target; the light (gains and offsets on a coarse grid, and what lies
behind the board), the point spread's width and the noise it finds in the picture. Weights are robust, and the
covariance is that of the pixels' noise or, where the board's parts contradict each other by more, of that.

Source:
    Hannemose, Wilm, Frisvad: Superaccurate camera calibration via inverse rendering (2019), arXiv 2003.09177, refines
    corners and calibrations through a rasteriser's picture. Here rays go through exact fish-eye laws, edges have closed
    forms, light is a linear part of the fit, and the result is held against the pixels' Cramer-Rao bound.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import eposit
from eposit import Camera, Status
from pipelines.adapters.results import PoseResult
from pipelines.detection import PointStatus, detect_points
from pipelines.detection.grey_picture import grey_picture
from pipelines.photometric.refine import refine
from render.targets import Target
from render.targets.chessboard import Chessboard

UNSUPPORTED_TARGET = "unsupported_target"  # status of targets other than the chessboard with its circle
LEAST_POINTS = 4  # that a pose needs
SEPARATOR = ", "  # between the reasons of several points


def estimate(image: NDArray[np.uint8], camera: Camera, target: Target) -> PoseResult:
    """The pose of the target in an 8-bit image (height, width), or (height, width, 3) in colour.

    A tone curve and a sharpening that detection sees are undone first.

    Failures are a status: what detection says where it leaves too few points, that of the corner-based solver, or
    those of `refine`.
    """
    if not isinstance(target, Chessboard):
        return PoseResult(UNSUPPORTED_TARGET)
    found = detect_points(image, target)
    good = found.status == PointStatus.OK
    if np.sum(good) < LEAST_POINTS:
        return PoseResult(SEPARATOR.join(sorted(set(found.status[~good].tolist()))))
    corners = eposit.solve(target.points[good], found.points_px[good], camera, sigma_px=found.covariance_px2[good])
    if corners.status != Status.OK:
        return PoseResult(str(corners.status))
    light = found.encoding.light(grey_picture(image), found.points_px[good])
    refined = refine(light, camera, target, corners.cam_from_obj, corners.covariance, found.blur_px)
    if refined.shape is None:
        return PoseResult(refined.status, iterations=refined.iterations)
    pose = refined.shape.cam_from_obj
    return PoseResult(Status.OK, pose.R, pose.t, refined.iterations, refined.covariance)
