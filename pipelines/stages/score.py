"""Stage 4: errors of every estimate against the truth. Errors are estimate minus truth; failures keep their rows."""

from __future__ import annotations

from collections.abc import Container
from pathlib import Path

import numpy as np
import pyarrow as pa

from datasets.rows import pose_covariances, poses, table
from datasets.schema import COMPONENTS, SCORES
from datasets.store.dataset import Dataset
from eposit import Pose, Status
from eposit.arrays import Array, Mask
from eposit.pose import euler_error_rad, rotation_error_rad, rotation_error_vector
from pipelines.stages.failures import HIDDEN, failure_reasons, is_hidden
from render.targets import Target

KEY = ("frame_id", "solver", "point_source", "assumed_camera", "point_set", "noise_draw", "status")
TRUTH = ["frame_id", *(f"q_{axis}" for axis in "wxyz"), *(f"t_{axis}_mm" for axis in "xyz"), "tilt_deg"]
GROSS_FAILURE_FACTOR = 2.0  # the paper's star: "at least twice larger than the ground truth"


def is_gross_failure(failed: Mask, found_t: Array, true_t: Array) -> Mask:
    """(b,) whether there is no pose, or one at least GROSS_FAILURE_FACTOR times as far away as the true one.

    failed: (b,). found_t, true_t: (b, 3), one unit; NaN where there is none.
    """
    with np.errstate(invalid="ignore"):
        far = np.linalg.norm(found_t, axis=1) >= GROSS_FAILURE_FACTOR * np.linalg.norm(true_t, axis=1)
    return failed | far


def targets(dataset: Dataset, indices: Container[int]) -> list[Path]:
    """Estimate shards of some numbers, each of which gets a shard of scores."""
    return [path for path in dataset.shards("estimates") if dataset.index_of(path) in indices]


def is_done(dataset: Dataset, estimates: Path) -> bool:
    """Whether the scores of a shard of estimates are there."""
    return dataset.is_done(_path(dataset, estimates))


def forget(dataset: Dataset, estimates: Path) -> None:
    """Remove the scores of a shard of estimates that is about to change.

    Raises:
        UserError: the disk or its permissions refuse.
    """
    dataset.remove_shard(_path(dataset, estimates))


def run_shard(dataset: Dataset, estimates: Path) -> None:
    """Make one shard of `scores`."""
    rows = dataset.read_shard(estimates)
    frames = dataset.sibling(estimates, "frames")
    truth = dataset.read_shard(frames, TRUTH)
    place = {frame: i for i, frame in enumerate(truth["frame_id"].to_pylist())}
    truth = truth.take([place[frame] for frame in rows["frame_id"].to_pylist()])
    true = poses(truth)
    found = poses(rows)
    t_error = found.t - true.t
    euler = np.degrees(euler_error_rad(found.R, true.R))
    failed = rows["status"].to_numpy(zero_copy_only=False) != Status.OK
    columns = {name: rows[name] for name in KEY}
    columns |= {name: rows[name] for name in ("ambiguous", "covariance_unreliable")}
    hidden = is_hidden(dataset, estimates, rows)
    reasons = failure_reasons(dataset, estimates, rows)
    columns["failure_reason"] = [
        HIDDEN if no_pose and unseen else reason
        for reason, no_pose, unseen in zip(reasons, failed, hidden, strict=True)
    ]
    scores = {
        **_places(dataset.recipe.target, true),
        "tilt_deg": truth["tilt_deg"],
        "rotation_error_deg": np.degrees(rotation_error_rad(found.R, true.R)),
        **{f"r{axis}_error_deg": euler[:, i] for i, axis in enumerate("xyz")},
        **{f"t{axis}_error_mm": t_error[:, i] for i, axis in enumerate("xyz")},
        "t_error_relative": np.linalg.norm(t_error, axis=1) / np.linalg.norm(true.t, axis=1),
        "reprojection_rmse_px": rows["reprojection_rmse_px"],
        # No pose of a target that cannot be seen is right; one is made up.
        "gross_failure": np.where(hidden, ~failed, is_gross_failure(failed, found.t, true.t)),
        **_normalised(rows, rotation_error_vector(found.R, true.R), t_error),
    }
    arrays = {
        name: value.combine_chunks() if hasattr(value, "combine_chunks") else value
        for name, value in (columns | scores).items()
    }
    dataset.write_shard(_path(dataset, estimates), table(SCORES, arrays))


def _places(target: Target, true: Pose) -> dict[str, Array]:
    """Distance and field angle of the board's centre, of b poses."""
    centre = true.R @ target.board_centre + true.t
    return {
        "distance_mm": np.linalg.norm(centre, axis=1),
        "field_deg": np.degrees(np.arctan2(np.hypot(centre[:, 0], centre[:, 1]), centre[:, 2])),
    }


def _normalised(rows: pa.Table, rotation: Array, translation: Array) -> dict[str, Array]:
    """Errors over their stated standard deviations, NaN without them.

    rotation: (b, 3) vectors on the left, rad. translation: (b, 3) mm.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        values = np.hstack((rotation, translation)) / np.sqrt(np.einsum("bii->bi", pose_covariances(rows)))
    return {f"{name}_normalised": values[:, i] for i, name in enumerate(COMPONENTS)}


def _path(dataset: Dataset, estimates: Path) -> Path:
    return dataset.root / "scores" / estimates.name
