"""OpenCV's fish-eye calibration of many pictures: a camera and a pose of the board in each."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from eposit import Pose
from eposit.arrays import Array

COMMON = cv2.CALIB_USE_INTRINSIC_GUESS | cv2.CALIB_FIX_SKEW
ONE_COEFFICIENT = cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_FIX_K4
STAGED = (cv2.CALIB_RECOMPUTE_EXTRINSIC | ONE_COEFFICIENT, cv2.CALIB_RECOMPUTE_EXTRINSIC)  # one call after the other
AT_ONCE = (0,)  # one call, in which a picture keeps the pose that it got from the nominal camera as its start
STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 200, 1e-12)
LEAST_CORNERS = 6  # of a picture that takes part


@dataclass(frozen=True, slots=True)
class Calibration:
    """What `cv2.fisheye.calibrate` found."""

    matrix: Array  # (3, 3)
    coefficients: Array  # (4,) of theta^3 to theta^9
    cam_from_obj: Pose  # (b,), NaN for pictures that took no part
    rmse_px: Array  # (b,) root mean square distance of a picture's corners from their reprojection, NaN likewise


def calibrate(
    corners_in_obj: Array, corners_px: Array, size: tuple[int, int], f: float, calls: tuple[int, ...] = STAGED
) -> Calibration:
    """Equidistance with four coefficients, started from a nominal focal length and the image centre; no skew.

    corners_in_obj: (n, 3) of a flat board. corners_px: (b, n, 2), NaN where a corner was not found. size: width and
    height, px. calls: further flags of one call after the other, each started with what the one before found.

    OpenCV's Gauss-Newton is not damped: with all four coefficients free from the start it may run away, so STAGED fits
    one first. Its check of each picture's condition (CALIB_CHECK_COND) is left out: it ends the whole calibration where
    one picture is hard, and hard ones are wanted.

    Raises:
        cv2.error: OpenCV cannot calibrate from these corners.
        ValueError: no picture has enough corners.
    """
    found = np.all(np.isfinite(corners_px), axis=2)
    used = np.flatnonzero(found.sum(axis=1) >= LEAST_CORNERS)
    if not len(used):
        raise ValueError(f"no picture has {LEAST_CORNERS} corners; give pictures in which the board was found")
    in_obj = [corners_in_obj[found[i]][None] for i in used]
    pixels = [corners_px[i][found[i]][None] for i in used]
    matrix = np.array([[f, 0.0, size[0] / 2.0], [0.0, f, size[1] / 2.0], [0.0, 0.0, 1.0]])
    coefficients, turns, places = np.zeros((4, 1)), (), ()
    for flags in calls:
        _, matrix, coefficients, turns, places = cv2.fisheye.calibrate(
            in_obj, pixels, size, matrix, coefficients, flags=COMMON | flags, criteria=STOP
        )
    R, t = np.full((len(corners_px), 3, 3), np.nan), np.full((len(corners_px), 3), np.nan)
    rmse = np.full(len(corners_px), np.nan)
    for i, points, seen, turn, place in zip(used, in_obj, pixels, turns, places, strict=True):
        R[i], t[i] = cv2.Rodrigues(turn)[0], np.ravel(place)
        again, _ = cv2.fisheye.projectPoints(points.reshape(-1, 1, 3), turn, place, matrix, coefficients)
        rmse[i] = np.sqrt(np.mean(np.sum((again.reshape(-1, 2) - seen[0]) ** 2, axis=1)))
    return Calibration(np.asarray(matrix, np.float64), np.asarray(coefficients, np.float64).ravel(), Pose(R, t), rmse)
