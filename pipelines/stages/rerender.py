"""Some pictures of a dataset rendered anew and held against those that it has."""

from __future__ import annotations

import numpy as np

from datasets.plan import frame_count, plan, shard_count, shard_frames
from datasets.store.dataset import Dataset
from datasets.store.images import decode_pixels
from datasets.verify.problems import Kind, Problem
from pipelines.stages.generate import picture

MOST_DIFFERENCE = 1  # grey levels by which another processor or library may round


def rerendered_problems(dataset: Dataset, count: int) -> list[Problem]:
    """Pictures, of so many that are spread over the dataset, that another program, or a hand, has made.

    Raises:
        UserError: a shard is missing or damaged, or a picture cannot be rendered.
    """
    recipe = dataset.recipe
    frames, size, shards = plan(recipe), shard_frames(recipe), shard_count(recipe)
    chosen = np.unique(np.linspace(0, frame_count(recipe) - 1, min(count, len(frames))).round().astype(int)).tolist()
    problems: list[Problem] = []
    for number in chosen:
        path = dataset.shard_path("frames", number // size, shards)
        stored = dataset.read_shard(path, ["image"])["image"][number % size].as_py()["bytes"]
        found, wanted = decode_pixels(stored).astype(int), picture(recipe, frames[number]).astype(int)
        most = int(np.abs(found - wanted).max()) if found.shape == wanted.shape else 255
        if most > MOST_DIFFERENCE:
            text = f"{path}, frame {number}: its picture differs by up to {most} grey levels from one rendered now"
            problems.append(Problem(path, Kind.CHANGED, f"{text}; `repair` does not decide which of them is right"))
    return problems
