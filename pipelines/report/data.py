"""What a report shows, as plain arrays and rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from datasets.store import Dataset
from eposit.arrays import Array, Mask

ERRORS = {
    "rotation_error_deg": "rotation, deg",
    "rx_error_deg": "rx, deg",
    "ry_error_deg": "ry, deg",
    "rz_error_deg": "rz, deg",
    "tx_error_mm": "x, mm",
    "ty_error_mm": "y, mm",
    "tz_error_mm": "z, mm",
    "t_error_relative": "translation, relative",
    "reprojection_rmse_px": "reprojection, px",
}
STEEP_DEG = 45.0
SETTING = ("solver", "points", "camera", "use")


@dataclass(frozen=True, slots=True)
class Series:
    """Scores of one setting."""

    name: str
    frame_id: NDArray[np.int64]
    errors: dict[str, Array]  # column to values, NaN for failures
    failed: Mask
    star: Mask


def series(scores: pa.Table) -> list[Series]:
    """One series for each setting, in the order of the table."""
    names = [" ".join(key) for key in zip(*(scores[name].to_pylist() for name in SETTING), strict=True)]
    found: list[Series] = []
    for name in dict.fromkeys(names):
        part = scores.filter(pa.array([other == name for other in names]))
        errors = {column: part[column].to_numpy() for column in ERRORS}
        failed = np.array([status != "ok" for status in part["status"].to_pylist()])
        star = np.array(part["star"].to_pylist())
        found.append(Series(name, part["frame_id"].to_numpy(), errors, failed, star))
    return found


def score_rows(found: list[Series], cameras: dict[int, str]) -> list[dict[str, Any]]:
    """Medians and 95th percentiles of absolute errors, and failures, for each setting and camera."""
    rows: list[dict[str, Any]] = []
    for item in found:
        camera = np.array([cameras[int(frame)] for frame in item.frame_id])
        for name in dict.fromkeys(camera.tolist()):
            mask = camera == name
            row: dict[str, Any] = {"setting": item.name, "camera": name, "n": int(mask.sum())}
            row["failed"], row["star"] = int(item.failed[mask].sum()), int(item.star[mask].sum())
            for column in ERRORS:
                values = np.abs(item.errors[column][mask & ~item.failed])
                row[column] = (float(np.median(values)), float(np.percentile(values, 95))) if len(values) else None
            rows.append(row)
    return rows


def detection_rows(dataset: Dataset, frames: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Corner and circle errors for each camera, tilt up to 45 degrees and beyond."""
    target = dataset.recipe.target
    n = len(target.points)
    truth, found = dataset.read("keypoints"), dataset.read("detections")
    error = np.stack([found[f"{a}_px"].to_numpy() - truth[f"{a}_px"].to_numpy() for a in "xy"], axis=1).reshape(
        -1, n, 2
    )
    ok = (found["status"].to_numpy(zero_copy_only=False) == "ok").reshape(-1, n)
    tilt = np.array([frame["tilt_deg"] for frame in frames])
    camera = np.array([frame["camera_name"] for frame in frames])
    rows: list[dict[str, Any]] = []
    for name in dict.fromkeys(camera.tolist()):
        for label, band in ((f"up to {STEEP_DEG:g}", tilt <= STEEP_DEG), (f"beyond {STEEP_DEG:g}", tilt > STEEP_DEG)):
            mask = (camera == name) & band
            if not np.any(mask):
                continue
            corners = error[mask, : target.circle_index][ok[mask, : target.circle_index]]
            circle = error[mask, target.circle_index][ok[mask, target.circle_index]]
            rows.append(
                {
                    "camera": name,
                    "tilt": label,
                    "frames": int(mask.sum()),
                    "boards": int(ok[mask, : target.circle_index].any(axis=1).sum()),
                    "corners": len(corners),
                    "rms": float(np.sqrt(np.mean(corners**2))) if len(corners) else np.nan,
                    "mean_x": float(corners[:, 0].mean()) if len(corners) else np.nan,
                    "mean_y": float(corners[:, 1].mean()) if len(corners) else np.nan,
                    "max": float(np.linalg.norm(corners, axis=1).max()) if len(corners) else np.nan,
                    "circles": len(circle),
                    "circle_rms": float(np.sqrt(np.mean(circle**2))) if len(circle) else np.nan,
                }
            )
    return rows
