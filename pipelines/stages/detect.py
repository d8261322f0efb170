"""Stage 2: find the target's points in the images, from the PNG's bytes and the target's dimensions alone.

Each detector has its own shards beside the others'; those of our own have no name in theirs.

A picture that takes longer than it may is tried once more, as a crowded machine may have slowed it; then its points are
`too_late`, and its shard is provisional: the next run makes it again.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from datasets.plan import shard_count
from datasets.rows import decode_image, table
from datasets.schema import DETECTIONS
from datasets.store.dataset import Dataset
from eposit.arrays import Array
from pipelines.detection import Detection, Detector, PointStatus, detect_points
from pipelines.detection.time_limit import DETECT_SECONDS
from render.targets.kinds import AnyTarget

TRIES = 2  # of a picture that takes too long


def path_of(dataset: Dataset, index: int, detector: str) -> Path:
    """Place of one shard."""
    return dataset.shard_path("detections", index, shard_count(dataset.recipe), variant_of(detector))


def variant_of(detector: str) -> str:
    """A detector's name in those of its shards."""
    return "" if detector == Detector.EDGE_FIT else detector


def is_done(dataset: Dataset, index: int, detector: str) -> bool:
    """Whether a shard is there, and is not provisional."""
    return dataset.is_done(path_of(dataset, index, detector))


def is_provisional(dataset: Dataset, index: int, detector: str) -> bool:
    """Whether a shard is there that has pictures which took too long."""
    return dataset.is_provisional(path_of(dataset, index, detector))


def run_shard(
    dataset: Dataset,
    index: int,
    advance: Callable[[], None] = lambda: None,
    *,
    detector: str,
    seconds: float = DETECT_SECONDS,
) -> str | None:
    """Make one shard of `detections` from the same shard of `frames`; which pictures took too long, if any did.

    advance: called after each frame. seconds: of processor time that a picture may take.
    """
    _load_kernels()
    path = dataset.shard_path("frames", index, shard_count(dataset.recipe))
    frames = dataset.read_shard(path, ["frame_id", "image"])
    parts: list[pa.Table] = []
    late: list[int] = []
    for frame_id, image in zip(frames["frame_id"].to_pylist(), frames["image"].to_pylist(), strict=True):
        found = _detected(decode_image(image, path, frame_id), dataset.recipe.target, detector, seconds)
        if _is_late(found):
            late.append(frame_id)
        n = len(found.status)
        columns = {
            "frame_id": np.full(n, frame_id),
            "detector": np.full(n, detector),
            "point_id": np.arange(n),
            "x_px": found.points_px[:, 0],
            "y_px": found.points_px[:, 1],
            "var_x_px2": found.covariance_px2[:, 0, 0],
            "cov_xy_px2": found.covariance_px2[:, 0, 1],
            "var_y_px2": found.covariance_px2[:, 1, 1],
            "status": found.status,
            "finder": np.full(n, found.finder),
            "blur_px": np.full(n, found.blur_px),
            "joint_factor_px": _lists(found.joint_factor, n),
        }
        parts.append(table(DETECTIONS, columns))
        advance()
    dataset.write_shard(path_of(dataset, index, detector), pa.concat_tables(parts), is_provisional=bool(late))
    return f"{'frames' if late[1:] else 'frame'} {', '.join(map(str, late))}" if late else None


def _detected(image: NDArray[np.generic], target: AnyTarget, detector: str, seconds: float) -> Detection:
    found = detect_points(image, target, detector, seconds)
    for _ in range(TRIES - 1):
        if _is_late(found):
            found = detect_points(image, target, detector, seconds)
    return found


def _is_late(found: Detection) -> bool:
    return bool(np.any(found.status == PointStatus.TOO_LATE))


@functools.cache
def _load_kernels() -> None:
    """Once in a process, as loading or compiling them is no part of any picture's time."""
    from pipelines.detection.prepare import compile_kernels

    compile_kernels()


def _lists(factor: Array | None, n: int) -> list[Array | None]:
    """Rows of (n, 2, k) as lists; None for those of NaN."""
    if factor is None:
        return [None] * n
    return [row.ravel() if np.all(np.isfinite(row)) else None for row in factor]
