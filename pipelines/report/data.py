"""What a report shows, as plain arrays and rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from datasets.rows import numbers
from datasets.schema import COMPONENTS
from eposit.arrays import Array, Mask
from pipelines.stages.failures import HIDDEN
from pipelines.statistics import FEW, bootstrap, median, percentile95, rate

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
SETTING = ("solver", "point_source", "assumed_camera", "point_set")


@dataclass(frozen=True, slots=True)
class Series:
    """Scores of one setting."""

    name: str
    frame_id: NDArray[np.int64]
    errors: dict[str, Array]  # column to values, NaN for failures
    normalised: Array  # (n, 6) errors over their stated standard deviations, NaN without
    failed: Mask  # no pose, of a target that can be seen
    gross: Mask


def series(scores: pa.Table) -> list[Series]:
    """One series for each setting, in the order of the table."""
    names = [" ".join(key) for key in zip(*(scores[name].to_pylist() for name in SETTING), strict=True)]
    found: list[Series] = []
    for name in dict.fromkeys(names):
        part = scores.filter(pa.array([other == name for other in names]))
        errors = dict(zip(ERRORS, numbers(part, *ERRORS).T, strict=True))
        outcome = zip(part["status"].to_pylist(), part["failure_reason"].to_pylist(), strict=True)
        failed = np.array([status != "ok" and reason != HIDDEN for status, reason in outcome])
        gross = np.array(part["gross_failure"].to_pylist())
        normalised = numbers(part, *(f"{component}_normalised" for component in COMPONENTS))
        found.append(Series(name, part["frame_id"].to_numpy(), errors, normalised, failed, gross))
    return found


def score_rows(found: list[Series], cameras: dict[int, str]) -> list[dict[str, Any]]:
    """Medians and 95th percentiles of absolute errors, and failures, for each setting and camera, with intervals.

    The intervals are bootstrapped over the frames; the draws of a frame stay together.
    """
    rows: list[dict[str, Any]] = []
    for item in found:
        camera = np.array([cameras[int(frame)] for frame in item.frame_id])
        for name in dict.fromkeys(camera.tolist()):
            mask = camera == name
            order = np.flatnonzero(mask)[np.argsort(item.frame_id[mask], kind="stable")]
            by_frame = order.reshape(len(np.unique(item.frame_id[mask])), -1)  # every frame has all draws
            failed, gross = item.failed[by_frame], item.gross[by_frame]
            row: dict[str, Any] = {"setting": item.name, "camera": name, "n": order.size}
            row |= {"failed": int(failed.sum()), "gross": int(gross.sum())}
            row |= {"failed_rate": rate(failed), "gross_rate": rate(gross)}
            for column in ERRORS:
                values = np.where(failed, np.nan, np.abs(item.errors[column][by_frame]))
                both = [bootstrap(values, statistic, resamples=FEW) for statistic in (median, percentile95)]
                row[column] = None if np.isnan(both[0].value) else both
            rows.append(row)
    return rows


def normalised_rows(found: list[Series]) -> list[dict[str, Any]]:
    """RMS of the normalised errors of each setting that states covariances."""
    rows: list[dict[str, Any]] = []
    for item in found:
        stated = item.normalised[np.all(np.isfinite(item.normalised), axis=1)]
        if len(stated):
            rows.append({"setting": item.name, "n": len(stated), "rms": np.sqrt(np.mean(stated**2, axis=0)).tolist()})
    return rows
