"""Errors of detected points against the truth, point by point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from datasets.errors import UserError
from datasets.rows import covariances_by_frame, numbers, of_detector, points_by_frame
from datasets.store.dataset import Dataset
from eposit.arrays import Array, Mask, shown
from pipelines.statistics import whitened
from render.targets.kinds import AnyTarget


@dataclass(frozen=True, slots=True)
class PointErrors:
    """Errors of one detector: f frames of n points, the circle last.

    Of a target without a raised circle the points of the print are the corners, and the last place is empty: NaN.
    """

    detector: str
    error: Array  # (f, n, 2) detected minus true, px; NaN where there is none
    normalised: Array  # (f, n, 2) the same in units of the stated covariance
    radial: Array  # (f, n) along the radius from the true principal point, px
    along_x: Array  # (f, n) along the image of the board's x, px; NaN for the circle
    theta_deg: Array  # (f, n) true angle from the optical axis
    side_px: Array  # (f, n) side of the local square; NaN for the circle
    in_image: Mask  # (f, n) whether a point is visible in the picture
    made_up: Mask  # (f, n) found, though it is not visible; it has no error
    status: NDArray[np.str_]  # (f, n)


def point_errors(dataset: Dataset, frames: Sequence[dict[str, Any]]) -> list[PointErrors]:
    """One for each detector whose points are there. frames: rows of `frames`, with the camera's principal point."""
    return errors_of(dataset.recipe.target, frames, dataset.read("keypoints"), dataset.read("detections"))


def check_all_there(detector: str, found: float, frames: int) -> None:
    """Refuse a detector whose points are there for `found` of so many frames only.

    Raises:
        UserError: they are not there for all.
    """
    if found != frames:
        raise UserError(
            f"points of the detector {shown(detector)} are there for {found:g} of {frames} frames; run the detect "
            "stage with it to its end, or see what `verify` says"
        )


def errors_of(
    target: AnyTarget, frames: Sequence[dict[str, Any]], truth: pa.Table, found: pa.Table
) -> list[PointErrors]:
    """One for each detector. truth and found: rows of `keypoints` and `detections` of these frames, in their order.

    Raises:
        UserError: a detector's points are there for some of the frames only.
    """
    ids, n = [frame["frame_id"] for frame in frames], len(target.points)
    points = points_by_frame(truth, target)
    true = np.stack([points[i] for i in ids])
    theta = numbers(truth, "theta_deg").reshape(-1, n)
    inside = truth["in_image"].to_numpy(zero_copy_only=False).reshape(-1, n)
    visible = np.array([seen is not False for seen in truth["visible"].to_pylist()]).reshape(-1, n)
    inside &= visible
    centre = np.array([[frame["cx_px"], frame["cy_px"]] for frame in frames])
    radius = true - centre[:, None]
    radius /= np.maximum(np.linalg.norm(radius, axis=-1, keepdims=True), 1e-9)
    along, side = _board_directions(true, target.point_grid)
    errors: list[PointErrors] = []
    for detector in dict.fromkeys(found["detector"].to_pylist()):
        rows = of_detector(found, detector)
        check_all_there(detector, rows.num_rows / n, len(ids))
        points, covariances = points_by_frame(rows, target), covariances_by_frame(rows, target)
        check_all_there(detector, sum(i in points for i in ids), len(ids))
        error = np.stack([points[i] for i in ids]) - true
        covariance = np.stack([covariances[i] for i in ids])
        status = rows["status"].to_numpy(zero_copy_only=False).astype(str).reshape(-1, n)
        made_up = np.isfinite(error[..., 0]) & ~visible
        error[made_up] = np.nan
        radial, along_x = np.sum(error * radius, axis=-1), np.sum(error * along[:, :n], axis=-1)
        values = (error, _whitened(error, covariance), radial, along_x, theta, side, inside, made_up, status)
        errors.append(PointErrors(detector, *(_with_circle(item, along.shape[1]) for item in values)))
    return errors


def _with_circle(values: NDArray[Any], places: int) -> NDArray[Any]:
    """(f, places, ...) values of (f, n, ...), with an empty last place where the target has no circle."""
    missing = places - values.shape[1]
    if missing <= 0:
        return values
    empty = np.zeros((len(values), missing, *values.shape[2:]), values.dtype)
    return np.concatenate((values, np.full_like(empty, np.nan) if values.dtype.kind == "f" else empty), axis=1)


def _board_directions(true: Array, inner: tuple[int, int]) -> tuple[Array, Array]:
    """(f, n, 2) unit image of the board's x and (f, n) side of the local square, by differences of true points.

    n counts the points of the print and a circle behind them.
    """
    across, down = inner
    grid = true[:, : across * down].reshape(-1, down, across, 2)
    along_y, along_x = np.gradient(grid, axis=(1, 2))
    area = np.abs(along_x[..., 0] * along_y[..., 1] - along_x[..., 1] * along_y[..., 0])
    unit = along_x / np.linalg.norm(along_x, axis=-1, keepdims=True)
    flat, side = unit.reshape(len(true), -1, 2), np.sqrt(area).reshape(len(true), -1)
    none = np.full((len(true), 1), np.nan)
    return np.concatenate((flat, none[..., None].repeat(2, axis=2)), axis=1), np.hstack((side, none))


def _whitened(error: Array, covariance: Array) -> Array:
    """L^-1 e with L L^T the covariance; NaN where there is none."""
    out = np.full(error.shape, np.nan)
    known = np.all(np.isfinite(covariance), axis=(-1, -2)) & np.isfinite(error[..., 0])
    if np.any(known):
        out[known] = whitened(covariance[known], error[known])
    return out
