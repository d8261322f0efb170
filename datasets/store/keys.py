"""Which rows a shard must have: those of the frames that the plan gives it, in their order."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa

from datasets.plan import frame_ids_of_shard, shard_count
from datasets.recipe.model import Recipe
from datasets.schema import FRAME_ID

ONE_A_FRAME = ("frames", "bounds")
ONE_A_POINT = ("keypoints", "detections")
POINT_ID = "point_id"


def fault_of_keys(recipe: Recipe, path: Path, rows: pa.Table) -> str | None:
    """What is wrong with the frames, and the points, of a shard's rows; None if nothing.

    path: of the shard, whose name tells its number. rows: with `frame_id`; `point_id` is checked where it is there.
    """
    index, count = numbers_of(path)
    if count != shard_count(recipe) or index >= count:
        return f"it is shard {index} of {count}, and the recipe has {shard_count(recipe)}"
    planned = np.array(frame_ids_of_shard(recipe, index))
    points = len(recipe.target.points)
    repeats = _repeats(path.parent.name, points, len(rows), len(planned))
    if repeats < 1 or not np.array_equal(rows[FRAME_ID].to_numpy(), np.repeat(planned, repeats)):
        return f"its rows are not those of frames {planned[0]} to {planned[-1]}"
    if POINT_ID in rows.column_names and not np.array_equal(
        rows[POINT_ID].to_numpy(), np.tile(np.arange(points), len(planned))
    ):
        return f"its rows do not have every point from 0 to {points - 1} of each frame in order"
    return None


def numbers_of(path: Path) -> tuple[int, int]:
    """The number of a shard and how many there are, from its name."""
    _, number, _, count = path.stem.rsplit("-", 3)
    return int(number), int(count)


def order_of(path: Path) -> str:
    """What sorts shards by their names: a text in which numbers have as many digits, however large they are."""
    variant, number, _, count = path.stem.rsplit("-", 3)
    return f"{variant}-{int(number):012d}-of-{int(count):012d}"


def _repeats(table: str, points: int, rows: int, frames: int) -> int:
    """How many rows each frame has; of estimates and scores as many as there are draws, which their number tells."""
    if table in ONE_A_FRAME:
        return 1
    return points if table in ONE_A_POINT else rows // frames
