"""The pixels' Cramer-Rao bound of every frame's pose: what errors of all solvers are held against."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa

from datasets.plan import Frame, frames_of_shard, shard_count
from datasets.rows import table
from datasets.schema import BOUNDS
from datasets.store.dataset import Dataset
from eposit.arrays import Array
from pipelines.photometric.image_flow import POSE
from pipelines.photometric.pixel_bound import pixel_bound
from pipelines.stages.generate import linear_light
from render.sensor.develop import FrameContext
from render.targets.chessboard import Chessboard


def is_done(dataset: Dataset, index: int) -> bool:
    """Whether a shard is there."""
    return dataset.is_done(_path(dataset, index))


def run_shard(dataset: Dataset, index: int, advance: Callable[[], None] = lambda: None) -> None:
    """Make one shard of `bounds`. advance: called after each frame."""
    parts: list[pa.Table] = []
    for frame in frames_of_shard(dataset.recipe, index):
        bound = _bound(dataset, frame).reshape(1, POSE * POSE)
        parts.append(table(BOUNDS, {"frame_id": [frame.frame_id], "covariance": list(bound)}))
        advance()
    dataset.write_shard(_path(dataset, index), pa.concat_tables(parts))


def _bound(dataset: Dataset, frame: Frame) -> Array:
    """(6, 6), NaN where the pixels do not determine the pose, and for targets other than the chessboard."""
    target, camera = dataset.recipe.target, frame.camera.true_camera()
    if not isinstance(target, Chessboard):
        return np.full((POSE, POSE), np.nan)
    linear = linear_light(dataset, frame)
    context = FrameContext(target, camera, frame.cam_from_obj, frame.rate, linear.region, frame.sensor_seed)
    try:
        return pixel_bound(linear, frame.sensor, context)
    except np.linalg.LinAlgError:
        return np.full((POSE, POSE), np.nan)


def _path(dataset: Dataset, index: int) -> Path:
    return dataset.shard_path("bounds", index, shard_count(dataset.recipe))
