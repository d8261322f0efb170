"""Stage 2: find the target's points in the images, from the PNG's bytes and the target's dimensions alone."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pyarrow as pa

from datasets.plan import shard_count
from datasets.schema import DETECTIONS
from datasets.store import Dataset
from pipelines.detection import detect_points
from pipelines.rows import decode_image, table


def is_done(dataset: Dataset, index: int) -> bool:
    """Whether a shard is there."""
    return dataset.is_done(dataset.shard_path("detections", index, shard_count(dataset.recipe)))


def run_shard(dataset: Dataset, index: int, advance: Callable[[], None] = lambda: None) -> None:
    """Make one shard of `detections` from the same shard of `frames`.

    advance: called after each frame.
    """
    count = shard_count(dataset.recipe)
    path = dataset.shard_path("frames", index, count)
    frames = dataset.read_shard(path)
    parts: list[pa.Table] = []
    for frame_id, image in zip(frames["frame_id"].to_pylist(), frames["image"].to_pylist(), strict=True):
        found = detect_points(decode_image(image, path, frame_id), dataset.recipe.target)
        n = len(found.status)
        columns = {
            "frame_id": np.full(n, frame_id),
            "point_id": np.arange(n),
            "x_px": found.points_px[:, 0],
            "y_px": found.points_px[:, 1],
            "status": found.status,
            "finder": np.full(n, found.finder),
            "blur_px": np.full(n, found.blur_px),
        }
        parts.append(table(DETECTIONS, columns))
        advance()
    dataset.write_shard(dataset.shard_path("detections", index, count), pa.concat_tables(parts))
