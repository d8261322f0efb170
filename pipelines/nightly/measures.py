"""A dataset's accuracy as one row for each frame and system, with the metrics that a night is judged by as columns.

A system is a detector, whose rows hold the corners and the circle, or a setting of a solver, whose rows hold poses.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from datasets.rows import pose_covariances
from datasets.schema import COMPONENTS, FRAMES
from datasets.store.dataset import Dataset
from datasets.store.nulls import with_nans
from eposit import Status
from eposit.arrays import Array, Mask
from pipelines.nightly.metrics import CORNERS, METRICS, POSES, SIGNED_POSES, Metric
from pipelines.report.data import SETTING
from pipelines.report.points import PointErrors, point_errors
from pipelines.stages.estimate import REACHES_BOUND
from pipelines.statistics import squares_over
from render.sensor.presets import regime_of

EXACT_POINTS = "truth"  # poses of exact points: their errors are rounding, whose size means nothing
KEY = {
    "regime": "sensor regime",
    "camera_name": "camera's name in the recipe",
    "system": "detector, or a solver with its setting",
}


@dataclass(frozen=True, slots=True)
class Slice:
    """Frames of one regime and camera as one system saw them, in the order of `frame_id`."""

    regime: str
    camera: str
    system: str
    frame_id: NDArray[np.int64]  # (f,)
    pose_id: NDArray[np.int64]  # (f,)
    failed: Mask  # (f,)
    values: dict[str, Array]  # metric to (f,), NaN where the frame has none

    @property
    def name(self) -> str:
        """As shown and as `explain` takes it."""
        return f"{self.regime}/{self.camera}/{self.system}"

    def has(self, metrics: Sequence[str]) -> Mask:
        """(m, f) whether a frame has a metric."""
        nothing = np.full(len(self.frame_id), np.nan)
        return np.isfinite([self.values.get(name, nothing) for name in metrics]).reshape(len(metrics), len(nothing))

    def by_pose(self, metrics: Sequence[str], poses: NDArray[np.int64]) -> Array:
        """(m, p) means of metrics over the frames of each of `poses`, which are sorted; NaN where none has it."""
        values = np.array([self.values[name] for name in metrics]).reshape(len(metrics), len(self.pose_id))
        if np.array_equal(self.pose_id, poses):  # one frame for each, as wherever a camera is in a pose once
            return np.where(np.isfinite(values), values, np.nan)
        return np.array([self._means(row, poses) for row in values]).reshape(len(metrics), len(poses))

    def _means(self, values: Array, poses: NDArray[np.int64]) -> Array:
        own = np.isfinite(values) & np.isin(self.pose_id, poses)
        place = np.searchsorted(poses, self.pose_id[own])
        with np.errstate(invalid="ignore"):
            return np.bincount(place, values[own], len(poses)) / np.bincount(place, minlength=len(poses))


def measure(dataset: Dataset) -> pa.Table:
    """The table of measures of a dataset that has scores: columns of `SCHEMA`.

    Raises:
        UserError: a stage is missing or a shard damaged.
    """
    columns = ["frame_id", "pose_id", "camera_name", "cx_px", "cy_px"]
    frames = dataset.read("frames", columns).to_pylist()
    regime = regime_of(dataset.recipe.sensor) or "own"
    parts = []
    if dataset.shards("detections"):
        parts += [_of_corners(item, frames, regime) for item in point_errors(dataset, frames)]
    parts += _of_poses(dataset, frames, regime)
    return pa.concat_tables(parts)


def same_views(one: Dataset, other: Dataset) -> bool:
    """Whether both show the same poses through the same true cameras, frame by frame."""
    columns = [name for name in FRAMES.names if name not in ("image", "render_seed", "sensor_seed", "master")]
    return one.read("frames", columns).equals(other.read("frames", columns))


SCHEMA = pa.schema(
    [
        *(pa.field(name, pa.string(), metadata={"meaning": meaning}) for name, meaning in KEY.items()),
        pa.field("frame_id", pa.int64(), metadata={"meaning": "frame in the dataset that was measured"}),
        pa.field("pose_id", pa.int64(), metadata={"meaning": "pose; frames of one pose differ by camera only"}),
        pa.field("failed", pa.bool_(), metadata={"meaning": "no corner found, or in any draw no pose"}),
        *(
            pa.field(metric.name, pa.float64(), metadata={"meaning": metric.meaning, "unit": metric.unit})
            for metric in METRICS.values()
        ),
    ]
)


def slices(measures: pa.Table) -> list[Slice]:
    """The slices of a table of measures, in the order of the table; one of before a metric was added lacks it."""
    keys = list(zip(*(measures[name].to_pylist() for name in KEY), strict=True))
    number = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    of_row = np.array([number[key] for key in keys])
    frame, pose, failed = (measures[name].to_numpy(zero_copy_only=False) for name in ("frame_id", "pose_id", "failed"))
    there = set(measures.column_names)
    columns = {name: measures[name].to_numpy(zero_copy_only=False) for name in METRICS if name in there}
    found: list[Slice] = []
    for key, i in number.items():
        own = np.flatnonzero(of_row == i)
        own = own[np.argsort(frame[own], kind="stable")]
        values = {name: column[own] for name, column in columns.items()}
        held = {name: column for name, column in values.items() if np.any(np.isfinite(column))}
        found.append(Slice(*key, frame_id=frame[own], pose_id=pose[own], failed=failed[own], values=held))
    return found


def _of_corners(item: PointErrors, frames: list[dict[str, Any]], regime: str) -> pa.Table:
    corners, circle, normalised = item.error[:, :-1], item.error[:, -1], item.normalised[:, :-1]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a frame without a corner has no mean
        values = {
            "corner_x": np.nanmean(corners[..., 0], axis=1),
            "corner_y": np.nanmean(corners[..., 1], axis=1),
            "corner_radial": np.nanmean(item.radial[:, :-1], axis=1),
            "corner_log_ms": np.log(np.nanmean(corners**2, axis=(1, 2))),
            "corner_nees": np.nanmean(normalised**2, axis=(1, 2)),
            "circle_x": circle[:, 0],
            "circle_y": circle[:, 1],
        }
    missing = ~np.any(np.isfinite(corners[..., 0]), axis=1)
    return _table(frames, regime, item.detector, missing, CORNERS, values)


def _of_poses(dataset: Dataset, frames: list[dict[str, Any]], regime: str) -> list[pa.Table]:
    found: list[pa.Table] = []
    scores = dataset.read("scores")
    nees = _pose_nees(dataset, scores)
    names = np.array([" ".join(key) for key in zip(*(scores[name].to_pylist() for name in SETTING), strict=True)])
    place = {frame["frame_id"]: i for i, frame in enumerate(frames)}
    row = np.array([place[frame] for frame in scores["frame_id"].to_pylist()])
    failed = scores["status"].to_numpy(zero_copy_only=False) != Status.OK
    length = np.sqrt(sum(_column(scores, f"t{axis}_error_mm") ** 2 for axis in "xyz"))
    with np.errstate(divide="ignore"):
        values = {
            **{f"{name}_normalised": _column(scores, f"{name}_normalised") for name in COMPONENTS},
            "pose_nees": nees,
            "pose_log_t": np.log(length),
            "pose_log_R": np.log(_column(scores, "rotation_error_deg")),
            **{f"t{axis}_error": _column(scores, f"t{axis}_error_mm") for axis in "xyz"},
            **{f"r{axis}_error": _column(scores, f"r{axis}_error_deg") for axis in "xyz"},
        }
    exact = scores["point_source"].to_numpy(zero_copy_only=False) == EXACT_POINTS
    for name in dict.fromkeys(names[~exact].tolist()):
        own = names == name
        means = {metric: _mean_by_row(row[own], column[own], len(frames)) for metric, column in values.items()}
        missing = np.bincount(row[own], failed[own], len(frames)) > 0.0
        # The choice is one of the solver and not of its numbers: one that begins to state covariances loses nothing.
        metrics = POSES if name.split()[0] == REACHES_BOUND else (*POSES, *SIGNED_POSES)
        found.append(_table(frames, regime, name, missing, metrics, means))
    return found


def _pose_nees(dataset: Dataset, scores: pa.Table) -> Array:
    """(r,) a sixth of the pose error's square over its covariance, NaN where none is stated; 1 on average if it holds.

    The stored normalised components are not enough, since the six errors depend on each other.
    """
    covariance = pose_covariances(dataset.read("estimates", ["covariance"]))
    with np.errstate(all="ignore"):  # of what states variances that are none
        deviation = np.sqrt(np.einsum("bii->bi", covariance))
        correlation = covariance / deviation[:, :, None] / deviation[:, None, :]
    normalised = np.stack([_column(scores, f"{name}_normalised") for name in COMPONENTS], axis=1)
    known = np.all(np.isfinite(normalised), axis=1) & np.all(np.isfinite(correlation), axis=(1, 2))
    nees = np.full(len(normalised), np.nan)
    if np.any(known):
        nees[known] = squares_over(correlation[known], normalised[known]) / 6.0
    return nees


def _mean_by_row(row: NDArray[np.int64], values: Array, count: int) -> Array:
    """(count,) mean of the draws of each frame, NaN where one has no value."""
    with np.errstate(invalid="ignore"):
        return np.bincount(row, values, count) / np.bincount(row, minlength=count)


def _table(
    frames: list[dict[str, Any]],
    regime: str,
    system: str,
    failed: Mask,
    metrics: tuple[Metric, ...],
    values: dict[str, Array],
) -> pa.Table:
    n = len(frames)
    columns: dict[str, Any] = {"regime": [regime] * n, "system": [system] * n, "failed": failed}
    columns |= {name: [frame[name] for frame in frames] for name in ("camera_name", "frame_id", "pose_id")}
    held = {metric.name for metric in metrics}
    for name in METRICS:
        column = values[name] if name in held else np.full(n, np.nan)
        columns[name] = pa.array(column, pa.float64(), mask=~np.isfinite(column))
    return pa.table([columns[field.name] for field in SCHEMA], schema=SCHEMA)


def _column(rows: pa.Table, name: str) -> Array:
    return with_nans(rows[name])
