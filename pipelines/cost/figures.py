"""What one frame of a recipe takes, as it was measured: processor time of each stage, bytes of each kind of file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from datasets.recipe.model import Recipe
from eposit.compiled.cache import folders
from pipelines.machine import processor

VERSION = 1  # of the file's form
LEFT_OUT = {"name": True, "description": True, "seed": True, "shard_frames": True}  # keys of no weight for one frame
LENGTHS = ("count", "start", "stop", "step")  # the trajectory's: how many poses, not what one takes
TABLES_OF_RUN = ("frames", "keypoints", "detections", "estimates", "scores")
IMAGES = ("masters", "truth")


@dataclass(frozen=True, slots=True)
class Figures:
    """What a frame takes; whose figures they are is told with every forecast."""

    seconds: Mapping[str, float]  # stage to processor time of a frame, s
    frame_bytes: Mapping[str, float]  # folder of the dataset to bytes of a frame
    shard_bytes: float  # what the files of a shard have beside: schemas, digests, meanings
    shard_files: int  # how many those are
    worker_mb: float  # that a process holds beside its shard, MB of 2**20 bytes
    source: str  # where and from how much they were taken, behind "from"


def read_figures(recipe: Recipe) -> Figures | None:
    """The figures that were measured on this machine for such frames; None if there are none that can be read."""
    for folder in folders():
        try:
            found = json.loads((folder / _file(recipe)).read_text(encoding="utf-8"))
            figures = Figures(**found)
            if _are_numbers(figures):
                return figures
        except (OSError, ValueError, TypeError, AttributeError):
            continue
    return None


def _are_numbers(figures: Figures) -> bool:
    """Whether a file of figures holds what it should.

    Raises:
        AttributeError: there is a value where a table should be.
    """
    values = [*figures.seconds.values(), *figures.frame_bytes.values(), figures.shard_bytes, figures.worker_mb]
    values.append(figures.shard_files)
    return isinstance(figures.source, str) and all(isinstance(value, int | float) and value >= 0 for value in values)


def keep_figures(recipe: Recipe, figures: Figures) -> Path | None:
    """Keep figures for later forecasts, in the first of this user's cache folders that can be written."""
    for folder in folders():
        try:
            folder.mkdir(parents=True, exist_ok=True)
            path = folder / _file(recipe)
            path.write_text(json.dumps(asdict(figures)), encoding="utf-8")
        except OSError:
            continue
        return path
    return None


def _file(recipe: Recipe) -> str:
    """Name of a recipe's figures: recipes whose frames cost the same share it, other processors do not."""
    content = recipe.model_dump(mode="json", exclude=LEFT_OUT)
    for name in LENGTHS:
        content["trajectory"].pop(name, None)
    text = json.dumps([VERSION, processor(), content], sort_keys=True)
    return f"cost-{hashlib.sha256(text.encode()).hexdigest()[:16]}.json"
