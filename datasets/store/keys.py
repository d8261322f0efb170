"""Which rows a shard must have: those of the frames that the plan gives it, in their order."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pyarrow as pa

from datasets.plan import frame_ids_of_shard, shard_count
from datasets.recipe.model import Recipe
from datasets.schema import FRAME_ID

ONE_A_FRAME = ("frames", "bounds")
ONE_A_POINT = ("keypoints", "detections")
POINT_ID, DRAW = "point_id", "noise_draw"
DETECTOR = "detector"
SETTING = ("solver", "point_source", "assumed_camera", "point_set")
DRAWS = re.compile(r"-truth\+[0-9.e+-]+px-x(\d{1,5})-[a-z]+-[a-z]+$")  # in the name of a setting with noise


def fault_of_keys(recipe: Recipe, path: Path, rows: pa.Table) -> str | None:
    """What is wrong with the frames, and the points, of a shard's rows; None if nothing.

    path: of the shard, whose name tells its number. rows: with `frame_id`; `point_id` is checked where it is there.
    """
    index, count = numbers_of(path)
    if count != shard_count(recipe) or index >= count:
        return f"it is shard {index} of {count}, and the recipe has {shard_count(recipe)}"
    planned = np.array(frame_ids_of_shard(recipe, index))
    points = len(recipe.target.points)
    if not np.array_equal(rows[FRAME_ID].to_numpy(), np.repeat(planned, _repeats(path, points))):
        return f"its rows are not those of frames {planned[0]} to {planned[-1]}"
    if POINT_ID in rows.column_names and not np.array_equal(
        rows[POINT_ID].to_numpy(), np.tile(np.arange(points), len(planned))
    ):
        return f"its rows do not have every point from 0 to {points - 1} of each frame in order"
    return _fault_of_setting(path, rows)


def variant_of(path: Path) -> str:
    """What a shard's name says before its number: the setting of estimates, the detector, or the table."""
    return path.stem.rsplit("-", 3)[0]


def numbers_of(path: Path) -> tuple[int, int]:
    """The number of a shard and how many there are, from its name."""
    _, number, _, count = path.stem.rsplit("-", 3)
    return int(number), int(count)


def order_of(path: Path) -> str:
    """What sorts shards by their names: a text in which numbers have as many digits, however large they are."""
    variant, number, _, count = path.stem.rsplit("-", 3)
    return f"{variant}-{int(number):012d}-of-{int(count):012d}"


def rows_of(recipe: Recipe, path: Path) -> int:
    """How many rows a shard must have; what its name alone tells, so that a larger file need not be read."""
    index = numbers_of(path)[0]
    frames = len(frame_ids_of_shard(recipe, index)) if index < shard_count(recipe) else 0
    return frames * _repeats(path, len(recipe.target.points))


def _repeats(path: Path, points: int) -> int:
    """How many rows each frame has; of estimates and scores as many as there are draws, which the name tells."""
    table = path.parent.name
    if table in ONE_A_FRAME:
        return 1
    draws = DRAWS.search(variant_of(path))
    return points if table in ONE_A_POINT else int(draws[1]) if draws else 1


def _fault_of_setting(path: Path, rows: pa.Table) -> str | None:
    """What in rows of detections, estimates or scores is not as the name of their shard tells; None if nothing."""
    if DETECTOR in rows.column_names:
        told = {str(name) for name in rows[DETECTOR].unique().to_pylist()}
        if len(told) != 1 or not (variant_of(path) == path.parent.name or told == {variant_of(path)}):
            return "its rows are of another detector than its name tells"
    if any(name not in rows.column_names for name in SETTING):
        return None
    told = [rows[name].unique().to_pylist() for name in SETTING]
    draws = DRAWS.search(variant_of(path))
    solver, points, camera, use = (str(values[0]) if len(values) == 1 else "" for values in told)
    name = f"{solver.replace(':', '@')}-{points}{f'-x{draws[1]}' if draws else ''}-{camera}-{use}"
    if len(rows) and name != variant_of(path):
        return "its rows are of another solver, points, camera or use than its name tells"
    repeats = int(draws[1]) if draws else 1
    if DRAW in rows.column_names and not np.array_equal(
        rows[DRAW].to_numpy(), np.tile(np.arange(repeats), len(rows) // repeats)
    ):
        return f"its rows do not have every draw from 0 to {repeats - 1} of each frame in order"
    return None
