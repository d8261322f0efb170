"""The experiment's pictures, and what each method makes of them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

import eposit
import eposit.released
from datasets.recipe.cameras import assumed_camera
from datasets.rows import camera_of, covariances_by_frame, of_detector, points_by_frame, poses
from datasets.schema import FRAMES
from datasets.store.dataset import Dataset
from eposit import Camera, Pose, Solution, Status
from eposit.arrays import Array, Mask
from eposit.pose import euler_error_rad, rotation_error_rad
from pipelines.paper.experiment.calibration import STAGED, Calibration, calibrate
from render.targets.chessboard import Chessboard

HARD = {11: "steep tilt", 13: "out of focus", 22: "field's edge"}  # by the picture's number, from 1; the paper's too
LEAST_POINTS = 4
STEPS = 2000  # of the released code


@dataclass(frozen=True, slots=True)
class Pictures:
    """What is known of b pictures of one camera."""

    target: Chessboard
    four: list[int]  # rows of the target's points
    true: Camera
    nominal: Camera
    cam_from_obj: Pose  # (b,) the truth
    points_px: Array  # (b, n, 2) detected, NaN where not found
    covariance_px2: Array  # (b, n, 2, 2)
    status: list[str]  # of the detection: "ok" with every point, else how many points there are and a reason

    @property
    def ordinary(self) -> Mask:
        """(b,) all but the hard ones."""
        return ~np.isin(np.arange(1, len(self.points_px) + 1), list(HARD))


@dataclass(frozen=True, slots=True)
class MethodResult:
    """What one method makes of b pictures."""

    name: str
    status: list[str]
    cam_from_obj: Pose  # (b,), NaN where the status is not ok
    used_px: Array  # (b,) root mean square distance of the points used from their reprojection
    board_px: Array  # (b,) likewise of all points found

    def rotation_rad(self, other: Pose) -> Array:
        """(b, 3) differences of the three angles from other poses."""
        return euler_error_rad(self.cam_from_obj.R, other.R)

    def turn_rad(self, other: Pose) -> Array:
        """(b,) angle between the rotations."""
        return rotation_error_rad(self.cam_from_obj.R, other.R)

    def shift_mm(self, other: Pose) -> Array:
        """(b, 3) differences of the translations."""
        return self.cam_from_obj.t - other.t


def read_pictures(dataset: Dataset, detector: str) -> Pictures:
    """The pictures of a finished dataset with the points of one detector."""
    frames = dataset.read("frames", [name for name in FRAMES.names if name != "image"])
    rows = of_detector(dataset.read("detections"), detector)
    target, first = dataset.recipe.chessboard(), frames.slice(0, 1).to_pylist()[0]
    points, sigmas = points_by_frame(rows, target), covariances_by_frame(rows, target)
    ids = frames["frame_id"].to_pylist()
    n, each = len(target.points), rows["status"].to_pylist()
    status = [_detection_status(each[i * n : (i + 1) * n]) for i in range(len(ids))]
    true = camera_of(first)
    return Pictures(
        target, dataset.recipe.four_indices(), true, assumed_camera(true, first["nominal_f_px"]), poses(frames),
        np.stack([points[i] for i in ids]), np.stack([sigmas[i] for i in ids]), status,
    )  # fmt: skip


def _detection_status(statuses: list[str]) -> str:
    bad = [status for status in statuses if status != Status.OK]
    return f"{len(statuses) - len(bad)} points, {bad[0]}" if bad else "ok"


def calibrated(pictures: Pictures, name: str, calls: tuple[int, ...] = STAGED) -> tuple[Calibration, MethodResult]:
    """OpenCV's calibration over all pictures, and its poses as those of a method; `calls` as for `calibrate`.

    Raises:
        cv2.error: OpenCV cannot calibrate from these corners.
    """
    corners = slice(0, pictures.target.circle_index)
    size = (pictures.true.width, pictures.true.height)
    found = calibrate(pictures.target.corners, pictures.points_px[:, corners], size, pictures.nominal.fx, calls)
    status: list[str] = [Status.OK if np.isfinite(rmse) else Status.POINTS_MISSING for rmse in found.rmse_px]
    board = [_rmse(_calibrated_px(found, pictures, i), pictures.points_px[i]) for i in range(len(status))]
    return found, MethodResult(name, status, found.cam_from_obj, found.rmse_px, np.array(board))


def _calibrated_px(found: Calibration, pictures: Pictures, i: int) -> Array:
    R, t = found.cam_from_obj.R[i], found.cam_from_obj.t[i]
    if not np.all(np.isfinite(R)):
        return np.full((len(pictures.target.points), 2), np.nan)
    points = pictures.target.points.reshape(-1, 1, 3)
    again, _ = cv2.fisheye.projectPoints(points, cv2.Rodrigues(R)[0], t, found.matrix, found.coefficients)
    return np.asarray(again, np.float64).reshape(-1, 2)


Solve = Callable[[Array, Array, Camera, Array], Solution]  # points in obj and in px, camera, covariances


def by_eposit(points: Array, pixels: Array, camera: Camera, sigma: Array) -> Solution:
    """The paper's equations."""
    return eposit.solve(points, pixels, camera, method="eposit")


def by_released(points: Array, pixels: Array, camera: Camera, sigma: Array) -> Solution:
    """The released code's behaviour, with fewer steps than its own 50 000, on which a picture may spend seconds."""
    return eposit.released.solve(points, pixels, camera, max_iterations=STEPS)


def by_best(points: Array, pixels: Array, camera: Camera, sigma: Array) -> Solution:
    """Ours: Gauss-Newton on the weighted reprojection error."""
    return eposit.solve(points, pixels, camera, sigma_px=sigma)


def estimated(
    name: str, pictures: Pictures, solve: Solve, camera: Camera, use: list[int] | None = None
) -> MethodResult:
    """A solver on every picture by itself. use: rows of the target's points; all that were found if None."""
    b = len(pictures.points_px)
    R, t, status = np.full((b, 3, 3), np.nan), np.full((b, 3), np.nan), list[str]()
    used_px, board_px = np.full(b, np.nan), np.full(b, np.nan)
    for i, (pixels, sigma) in enumerate(zip(pictures.points_px, pictures.covariance_px2, strict=True)):
        there = np.all(np.isfinite(pixels), axis=1)
        rows = np.flatnonzero(there) if use is None else np.array(use)
        if len(rows) < LEAST_POINTS or not np.all(there[rows]):
            status.append(Status.POINTS_MISSING)
            continue
        found = solve(pictures.target.points[rows], pixels[rows], camera, sigma[rows])
        status.append(str(found.status))
        if found.status != Status.OK:
            continue
        R[i], t[i] = found.cam_from_obj.R, found.cam_from_obj.t
        again = camera.project(found.cam_from_obj.apply(pictures.target.points))
        used_px[i], board_px[i] = _rmse(again[rows], pixels[rows]), _rmse(again, pixels)
    return MethodResult(name, status, Pose(R, t), used_px, board_px)


def _rmse(projected: Array, pixels: Array) -> float:
    """Root mean square distance over the points that are there, px."""
    squares = np.sum((projected - pixels) ** 2, axis=1)
    there = np.isfinite(squares)
    return float(np.sqrt(np.mean(squares[there]))) if np.any(there) else float("nan")
