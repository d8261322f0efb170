"""Why an estimate has no pose: for missing points what the detection says of them, else what the solver says."""

from __future__ import annotations

from pathlib import Path

import pyarrow as pa

from datasets.store.dataset import Dataset
from eposit import Status
from pipelines.stages.detect import variant_of
from pipelines.stages.settings import detector_of

BEYOND_LENS = "beyond_lens"  # a true point that the lens gives no image
SEPARATOR = ", "  # between the reasons of several points, each named once, in the order of the alphabet


def failure_reasons(dataset: Dataset, estimates: Path, rows: pa.Table) -> list[str | None]:
    """The reason of each row of a shard of estimates, None for a row with a pose.

    Raises:
        UserError: points are missing, and so is the shard of the detections that they come from.
    """
    names = ("frame_id", "status", "point_source", "point_set")
    status_of_points: dict[str, dict[int, list[str]]] = {}
    reasons: list[str | None] = []
    for frame, status, source, chosen in zip(*(rows[name].to_pylist() for name in names), strict=True):
        detector = detector_of(source)
        if status != Status.POINTS_MISSING:
            reasons.append(None if status == Status.OK else status)
        elif detector is None:
            reasons.append(BEYOND_LENS)
        else:
            if detector not in status_of_points:
                path = dataset.sibling(estimates, "detections", variant_of(detector))
                status_of_points[detector] = _by_frame(dataset, path)
            points = status_of_points[detector][frame]
            used = [points[i] for i in dataset.recipe.four_indices()] if chosen == "four" else points
            reasons.append(SEPARATOR.join(sorted(set(used) - {Status.OK})))
    return reasons


def _by_frame(dataset: Dataset, path: Path) -> dict[int, list[str]]:
    """frame_id to the status of each point of the target, of a shard of detections."""
    rows = dataset.read_shard(path, ["frame_id", "status"])
    found: dict[int, list[str]] = {}
    for frame, status in zip(rows["frame_id"].to_pylist(), rows["status"].to_pylist(), strict=True):
        found.setdefault(frame, []).append(status)
    return found
