"""Frames to look at, from the datasets in which the baseline and the candidate read them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.rows import decode_image, of_detector, points_by_frame
from datasets.store.dataset import Dataset
from eposit.arrays import Array
from pipelines.detection import Detector
from pipelines.nightly.page.pictures import Marks, Picture

REGION = tuple(f"region_{name}_px" for name in ("x", "y", "width", "height"))


@dataclass(frozen=True, slots=True)
class Wanted:
    """A frame of both datasets, and what the page says of it."""

    suite: str
    slice: str
    frame_id: int
    reason: str
    command: str  # that makes the frame again and shows it


def pictures_of(
    old: Dataset, new: Dataset, wanted: Sequence[Wanted], detector: str = Detector.EDGE_FIT
) -> list[Picture]:
    """The pictures of some frames with what a detector found on either side, in the order that is given.

    old, new: read the same pictures; `new` holds them.

    Raises:
        UserError: a shard is damaged.
        KeyError: a dataset lacks a frame.
    """
    truth = points_by_frame(new.read("keypoints"), new.recipe.target)
    sides = [points_by_frame(of_detector(side.read("detections"), detector), side.recipe.target) for side in (old, new)]
    crops = _crops(new, {item.frame_id for item in wanted})
    found: list[Picture] = []
    for item in wanted:
        crop, corner = crops[item.frame_id]
        marks = [_marks(points[item.frame_id], truth[item.frame_id]) for points in sides]
        named = (item.suite, item.slice, item.frame_id, item.reason, item.command)
        found.append(Picture(*named, crop, corner, marks[0], marks[1]))
    return found


def _marks(points: Array, true: Array) -> Marks:
    return Marks(points, points - true)


def _crops(dataset: Dataset, wanted: set[int]) -> dict[int, tuple[NDArray[np.uint8], tuple[int, int]]]:
    """frame_id to its rendered region, and where that begins."""
    found: dict[int, tuple[NDArray[np.uint8], tuple[int, int]]] = {}
    for path in dataset.shards("frames"):
        if wanted.isdisjoint(dataset.read_shard(path, ["frame_id"])["frame_id"].to_pylist()):
            continue
        rows = dataset.read_shard(path, ["frame_id", "image", *REGION])
        own = [i for i, frame_id in enumerate(rows["frame_id"].to_pylist()) if frame_id in wanted]
        found |= {row["frame_id"]: _crop(row, path) for row in rows.take(own).to_pylist()}
    return found


def _crop(row: dict[str, Any], path: Path) -> tuple[NDArray[np.uint8], tuple[int, int]]:
    image = decode_image(row["image"], path, row["frame_id"])
    x, y, width, height = (row[name] for name in REGION)
    return image[y : y + height, x : x + width], (x, y)
