"""Frames of a dataset to look at: the part of each picture that was rendered, and the points found in it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
    found: dict[int, Crop] = {}
    for path in dataset.shards("frames"):
        ids = dataset.read_shard(path, ["frame_id"])["frame_id"].to_pylist()
        own = [i for i, frame_id in enumerate(ids) if frame_id in wanted]
        if own:
            rows = dataset.read_shard(path, ["frame_id", "image", *REGION])
            found |= {row["frame_id"]: _crop(row, path) for row in rows.take(own).to_pylist()}
    return found


def marks_by_frame(dataset: Dataset, detector: str) -> dict[int, Marks]:
    """frame_id to what a detector found in it, of every frame.

    Raises:
        UserError: a shard is damaged.
    """
    true = points_by_frame(dataset.read("keypoints"), dataset.recipe.target)
    found = points_by_frame(of_detector(dataset.read("detections"), detector), dataset.recipe.target)
    return {frame_id: Marks(points, points - true[frame_id]) for frame_id, points in found.items()}


def _crop(row: dict[str, Any], path: Path) -> Crop:
    image = decode_image(row["image"], path, row["frame_id"], in_colour=True)
    region = Region(*(row[name] for name in REGION))
    return Crop(image[region.pixels], (region.x, region.y))
