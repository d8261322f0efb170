"""Errors of detected points against the truth, by detector, camera, tilt and field angle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.rows import covariances_by_frame, numbers, of_detector, points_by_frame
from datasets.store.dataset import Dataset
from eposit.arrays import Array, Mask
from pipelines.report.data import frame_means
from pipelines.spread import NORMAL_MAD
from pipelines.statistics import Interval, root, student

STEEP_DEG = 45.0
ANGLE_STEP_DEG = 15.0  # of the field-angle table; each row is centred on a multiple
LEAST_SIDE_PX = 20.0  # local square below which corners stand in a row of their own


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


def point_errors(dataset: Dataset, frames: list[dict[str, Any]]) -> list[PointErrors]:
    """One for each detector whose points are there. frames: rows of `frames`, with the camera's principal point."""
    target = dataset.recipe.target
    truth, found = dataset.read("keypoints"), dataset.read("detections")
    ids, n = [frame["frame_id"] for frame in frames], len(target.points)
    true = np.stack([points_by_frame(truth, target)[i] for i in ids])
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
        error = np.stack([points_by_frame(rows, target)[i] for i in ids]) - true
        covariance = np.stack([covariances_by_frame(rows, target)[i] for i in ids])
        status = rows["status"].to_numpy(zero_copy_only=False).astype(str).reshape(-1, n)
        made_up = np.isfinite(error[..., 0]) & ~visible
        error[made_up] = np.nan
        radial, along_x = np.sum(error * radius, axis=-1), np.sum(error * along[:, :n], axis=-1)
        values = (error, _whitened(error, covariance), radial, along_x, theta, side, inside, made_up, status)
        errors.append(PointErrors(detector, *(_with_circle(item, along.shape[1]) for item in values)))
    return errors


def tilt_rows(errors: list[PointErrors], frames: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Corner and circle errors for each detector and camera, tilt up to 45 degrees and beyond."""
    tilt = np.array([frame["tilt_deg"] for frame in frames])
    camera = np.array([frame["camera_name"] for frame in frames])
    bands = ((f"up to {STEEP_DEG:g}", tilt <= STEEP_DEG), (f"beyond {STEEP_DEG:g}", tilt > STEEP_DEG))
    rows: list[dict[str, Any]] = []
    for item in errors:
        for name in dict.fromkeys(camera.tolist()):
            for label, band in bands:
                chosen = (camera == name) & band
                mask = chosen & item.in_image.any(axis=1)
                made_up = int(item.made_up[chosen].sum())
                if np.any(mask) or made_up:
                    found = np.isfinite(item.error[mask, :-1, 0]).any(axis=1)
                    counts = {"frames": int(mask.sum()), "boards": int(found.sum()), "made_up": made_up}
                    rows.append(
                        {
                            "detector": item.detector,
                            "camera": name,
                            "tilt": label,
                            **counts,
                            **_row(item, mask),
                            "rms_interval": root_mean_square(item.error[mask, :-1]),
                            "bias": bias(item, mask),
                            "circle_interval": root_mean_square(item.error[mask, -1:]),
                        }
                    )
    return rows


def field_rows(errors: list[PointErrors], frames: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Corners in the picture by field angle and camera, large and small local squares apart."""
    camera = np.array([frame["camera_name"] for frame in frames])
    rows: list[dict[str, Any]] = []
    for item in errors:
        for name in dict.fromkeys(camera.tolist()):
            own = (camera == name)[:, None] & item.in_image[:, :-1]
            for angle, near in _angle_bands(item.theta_deg[:, :-1], own):
                for large in (True, False):
                    mask = near & ((item.side_px[:, :-1] >= LEAST_SIDE_PX) == large)
                    if not np.any(mask):
                        continue
                    error = item.error[:, :-1][mask]
                    ok = np.isfinite(error[:, 0])
                    size = ("from" if large else "below") + f" {LEAST_SIDE_PX:g}"
                    rows.append(
                        {
                            "detector": item.detector,
                            "camera": name,
                            "angle": f"{angle:g}",
                            "side": size,
                            "corners": len(error),
                            "found": float(np.mean(ok)),
                            "rms": _rms(error[ok]),
                            "max": float(np.linalg.norm(error[ok], axis=1).max()) if np.any(ok) else np.nan,
                            "normalised": _rms(item.normalised[:, :-1][mask][ok]),
                            "failures": _counted(item.status[:, :-1][mask][~ok]),
                        }
                    )
    return rows


def _angle_bands(theta: Array, own: Mask) -> Iterator[tuple[float, Mask]]:
    if not np.any(own):
        return
    for angle in np.arange(0.0, theta[own].max() + ANGLE_STEP_DEG, ANGLE_STEP_DEG):
        near = own & (np.abs(theta - angle) <= ANGLE_STEP_DEG / 2.0)
        if np.any(near):
            yield float(angle), near


def bias(item: PointErrors, frames: Mask) -> dict[str, Interval]:
    """Mean corner error of some frames along x, y and the radius, px, with intervals over the frames."""
    corners = item.error[frames, :-1]
    values = {"x": corners[..., 0], "y": corners[..., 1], "radius": item.radial[frames, :-1]}
    return {name: student(frame_means(each)) for name, each in values.items()}


def root_mean_square(values: Array) -> Interval:
    """Of (f, ...) values, with an interval over the frames; all count alike, NaN values take no part."""
    return root(student(frame_means(values**2)))


def _row(item: PointErrors, mask: Mask) -> dict[str, Any]:
    ok = np.isfinite(item.error[mask, :, 0])
    corners, circle = item.error[mask, :-1][ok[:, :-1]], item.error[mask, -1][ok[:, -1]]
    return {
        "corners": len(corners),
        "rms": _rms(corners),
        "scatter": NORMAL_MAD * float(np.median(np.abs(corners))) if len(corners) else np.nan,
        "mean_x": _mean(corners[:, 0]),
        "mean_y": _mean(corners[:, 1]),
        "mean_radial": _mean(item.radial[mask, :-1][ok[:, :-1]]),
        "mean_along_x": _mean(item.along_x[mask, :-1][ok[:, :-1]]),
        "max": float(np.linalg.norm(corners, axis=1).max()) if len(corners) else np.nan,
        "normalised": _rms(item.normalised[mask, :-1][ok[:, :-1]]),
        "circles": len(circle),
        "circle_rms": _rms(circle),
        "circle_normalised": _rms(item.normalised[mask, -1][ok[:, -1]]),
    }


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
        lower = np.linalg.cholesky(covariance[known])
        out[known] = np.linalg.solve(lower, error[known][..., None])[..., 0]
    return out


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else np.nan


def _mean(values: Array) -> float:
    return float(np.mean(values)) if values.size else np.nan


def _counted(status: NDArray[np.str_]) -> str:
    names, counts = np.unique(status, return_counts=True)
    return ", ".join(f"{count} {name}" for name, count in zip(names, counts, strict=True))
