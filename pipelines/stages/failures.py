"""Why an estimate has no pose: for missing points what the detection says of them, else what the solver says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa

from datasets.store.dataset import Dataset
from eposit import Status
from eposit.arrays import Mask
from pipelines.stages.detect import variant_of
from pipelines.stages.settings import detector_of

BEYOND_LENS = "beyond_lens"  # a true point that the lens gives no image
HIDDEN = "hidden"  # a point that is not there or that something stands before: nothing could have found it
LEAST_POINTS = 4  # of which a pose is made
SEPARATOR = ", "  # between the reasons of several points, each named once, in the order of the alphabet


def failure_reasons(dataset: Dataset, estimates: Path, rows: pa.Table) -> list[str | None]:
    """The reason of each row of a shard of estimates, None for a row with a pose.

    Raises:
        UserError: points are missing, and so is the shard of the detections that they come from.
    """
    names = ("frame_id", "status", "point_source", "point_set")
    visible = visible_points(dataset, estimates)
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
                status_of_points[detector] = _by_frame(dataset, path, visible)
            points = status_of_points[detector][frame]
            used = [points[i] for i in dataset.recipe.four_indices()] if chosen == "four" else points
            reasons.append(SEPARATOR.join(sorted(set(used) - {Status.OK})))
    return reasons


def visible_points(dataset: Dataset, estimates: Path) -> dict[int, list[bool]]:
    """frame_id to which points of the target are visible, of the frames of a shard of estimates.

    Where no rays were traced every point counts as visible.
    """
    rows = dataset.read_shard(dataset.sibling(estimates, "keypoints"), ["frame_id", "visible"])
    found: dict[int, list[bool]] = {}
    for frame, visible in zip(rows["frame_id"].to_pylist(), rows["visible"].to_pylist(), strict=True):
        found.setdefault(frame, []).append(visible is not False)
    return found


def is_hidden(dataset: Dataset, estimates: Path, rows: pa.Table) -> Mask:
    """(n,) whether rows of a shard of estimates had to find more points than are visible: no pose can be made of them.

    True points are given, not found.
    """
    visible = visible_points(dataset, estimates)
    four = dataset.recipe.four_indices()
    hidden: list[bool] = []
    for frame, source, chosen in zip(
        *(rows[name].to_pylist() for name in ("frame_id", "point_source", "point_set")), strict=True
    ):
        seen = [visible[frame][i] for i in four] if chosen == "four" else visible[frame]
        hidden.append(not source.startswith("truth") and sum(seen) < LEAST_POINTS)
    return np.array(hidden, bool)


def _by_frame(dataset: Dataset, path: Path, visible: dict[int, list[bool]]) -> dict[int, list[str]]:
    """frame_id to the status of each point of the target, of a shard of detections."""
    rows = dataset.read_shard(path, ["frame_id", "point_id", "status"])
    found: dict[int, list[str]] = {}
    for frame, point, status in zip(*(rows[name].to_pylist() for name in rows.column_names), strict=True):
        is_missing_as_hidden = status != Status.OK and not visible[frame][point]
        found.setdefault(frame, []).append(HIDDEN if is_missing_as_hidden else status)
    return found
