"""What the report keeps of a dataset, gathered shard by shard: a row of each frame and score, nothing of each point."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from datasets.store.dataset import Dataset
from pipelines.report.data import SCORE_COLUMNS, series
from pipelines.report.point_tables import PointTally
from pipelines.report.points import check_all_there, errors_of
from pipelines.report.run import Run

KEPT = ("frame_id", "pose_id", "time_s", "camera_name", "tilt_deg")
OF_CAMERA = ("cx_px", "cy_px")  # for the errors of points only


def gathered(dataset: Dataset) -> tuple[Run, list[PointTally]]:
    """A run that has been scored, and what is kept of each detector's points.

    Raises:
        UserError: a stage is missing or a shard damaged, or a detector's points are there for some frames only.
    """
    frames: list[dict[str, Any]] = []
    tallies: dict[str, PointTally] = {}
    # Who scores a whole system of their own may have detected nothing.
    detections = _by_index(dataset, dataset.whole("detections") if dataset.shards("detections") else ())
    names: dict[str, str] = {}  # each camera's once, however many frames have it
    for path in dataset.whole("frames"):
        rows = dataset.read_shard(path, [*KEPT, *OF_CAMERA]).to_pylist()
        _add_points(dataset, path, rows, detections, tallies)
        for row in rows:
            row["camera_name"] = names.setdefault(row["camera_name"], row["camera_name"])
            frames.append({name: row[name] for name in KEPT})
    found = series(dataset.each_shard("scores", list(SCORE_COLUMNS)))
    points = list(tallies.values())
    for item in points:
        check_all_there(item.detector, len(item.frames.corners), len(frames))
    return Run(dataset.recipe, frames, [item.frames for item in points], found), points


def _add_points(
    dataset: Dataset,
    path: Path,
    rows: list[dict[str, Any]],
    detections: Mapping[int, list[Path]],
    tallies: dict[str, PointTally],
) -> None:
    """Add the points of a shard of `frames`, whose rows are given."""
    found = detections.get(dataset.index_of(path), [])
    truth = dataset.read_shard(dataset.sibling(path, "keypoints")) if found else None
    for shard in found:
        for item in errors_of(dataset.recipe.target, rows, truth, dataset.read_shard(shard)):
            tallies.setdefault(item.detector, PointTally(item.detector)).add(item, rows)


def _by_index(dataset: Dataset, paths: Iterable[Path]) -> dict[int, list[Path]]:
    """Shards by their number."""
    found: dict[int, list[Path]] = {}
    for path in paths:
        found.setdefault(dataset.index_of(path), []).append(path)
    return found
