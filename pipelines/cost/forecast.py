"""What a dataset of so many frames takes, from the figures of one frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from datasets.plan.shards import shard_size
from datasets.recipe.model import Recipe
from pipelines.cost.figures import Figures

HELD_TIMES = 4.0  # a shard's rows are held as Python's objects, as a table, and as the file that is written
MOST_FRAMES = 1_000_000_000_000


@dataclass(frozen=True, slots=True)
class Forecast:
    """Frames and what they take; seconds are those of `workers`, each with a core of its own."""

    frames: int
    shards: int
    shard_frames: int
    files: int  # all of them
    bytes: Mapping[str, float]  # by folder of the dataset
    stage_seconds: Mapping[str, float]
    worker_mb: float
    workers: int
    source: str  # of the figures

    @property
    def seconds(self) -> float:
        """All stages one after the other, s."""
        return sum(self.stage_seconds.values())

    @property
    def total_bytes(self) -> float:
        """Everything that the folder holds at the end."""
        return sum(self.bytes.values())


def forecast(recipe: Recipe, figures: Figures, *, frames: int, workers: int, with_masters: bool) -> Forecast:
    """What `frames` frames like the recipe's take."""
    size = shard_size(recipe, frames)
    shards = -(-frames // size)
    each = {folder: value for folder, value in figures.frame_bytes.items() if with_masters or folder != "masters"}
    images = sum(1 for folder in ("masters", "truth") if each.get(folder))
    sizes = {folder: value * frames for folder, value in each.items()} | {"footers": figures.shard_bytes * shards}
    rows = sum(value for folder, value in each.items() if folder not in ("masters", "truth"))
    return Forecast(
        frames=frames,
        shards=shards,
        shard_frames=size,
        files=shards * figures.shard_files + images * frames,
        bytes=sizes,
        stage_seconds={stage: spent * frames / workers for stage, spent in figures.seconds.items()},
        worker_mb=figures.worker_mb + HELD_TIMES * min(size, frames) * rows / 2**20,
        workers=workers,
        source=figures.source,
    )


def sized(count: float) -> str:
    """Bytes as people read them: 3.2 TB."""
    return _scaled(count, ((1e15, "PB"), (1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")), "bytes")


def lasting(seconds: float) -> str:
    """A time as people read it: 3.2 days."""
    return _scaled(seconds, ((31557600.0, "years"), (86400.0, "days"), (3600.0, "hours"), (60.0, "minutes")), "seconds")


def _scaled(value: float, units: tuple[tuple[float, str], ...], smallest: str) -> str:
    scale, unit = next(((scale, unit) for scale, unit in units if value >= scale), (1.0, smallest))
    shown = value / scale
    return f"{shown:.2g} {unit}" if shown < 10.0 else f"{shown:.0f} {unit}"
