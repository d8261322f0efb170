"""Frames of a dataset to look at: the part of each picture that was rendered, and the points found in it."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.plan import frame_ids_of_shard
from datasets.rows import decode_image, of_detector, points_by_frame
from datasets.store.dataset import Dataset
from pipelines.pages.pictures import Marks
from render.targets.image_region import Region

REGION = tuple(f"region_{name}_px" for name in Region._fields)


@dataclass(frozen=True, slots=True)
class Crop:
    """The rendered region of a picture."""

    image: NDArray[np.uint8]  # (h, w), or (h, w, 3) RGB
    corner: tuple[int, int]  # x, y in the whole image of its first pixel, px


def crops(dataset: Dataset, wanted: Collection[int]) -> dict[int, Crop]:
    """frame_id to its rendered region, of those of the wanted frames that the dataset has.

    Raises:
        UserError: a shard is damaged.
    """
    rows = rows_of(dataset, "frames", ["image", *REGION], wanted)
    return {row["frame_id"]: _crop(row, path) for row, path in rows}


def rows_of(
    dataset: Dataset, table: str, columns: Sequence[str], wanted: Collection[int]
) -> Iterator[tuple[dict[str, Any], Path]]:
    """The rows of the wanted frames, each with the shard that it is in; only the shards that hold some are read.

    Raises:
        UserError: a shard is damaged.
    """
    for path in _holding(dataset, table, wanted):
        rows = dataset.read_shard(path, ["frame_id", *columns])
        own = [i for i, frame_id in enumerate(rows["frame_id"].to_pylist()) if frame_id in wanted]
        yield from ((row, path) for row in rows.take(own).to_pylist())


def marks_by_frame(dataset: Dataset, detector: str, wanted: Collection[int]) -> dict[int, Marks]:
    """frame_id to what a detector found in it, of the wanted frames.

    Raises:
        UserError: a shard is damaged.
    """
    target = dataset.recipe.target
    found: dict[int, Marks] = {}
    for path in _holding(dataset, "detections", wanted):
        own = points_by_frame(of_detector(dataset.read_shard(path), detector), target)
        true = points_by_frame(dataset.read_shard(dataset.sibling(path, "keypoints")), target) if own else {}
        found |= {i: Marks(own[i], own[i] - true[i]) for i in own if i in wanted}
    return found


def _holding(dataset: Dataset, table: str, wanted: Collection[int]) -> Iterator[Path]:
    """The shards of a table that hold some of the wanted frames."""
    for path in dataset.shards(table):
        ids = frame_ids_of_shard(dataset.recipe, dataset.index_of(path))
        if any(frame_id in ids for frame_id in wanted):
            yield path


def _crop(row: dict[str, Any], path: Path) -> Crop:
    image = decode_image(row["image"], path, row["frame_id"], in_colour=True)
    region = Region(*(row[name] for name in REGION))
    return Crop(image[region.pixels], (region.x, region.y))
