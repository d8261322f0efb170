"""What a dataset of so many frames takes, from the figures of one frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from datasets.plan.shards import shard_size
from datasets.recipe.model import Recipe
from datasets.store.kept_masters import Kept
from pipelines.cost.figures import Figures

HELD_TIMES = 4.0  # a shard's rows are held as Python's objects, as a table, and as the file that is written
ENTRY_BYTES = 96  # of a frame in an archive beside its linear image: a header, an entry of the directory, two names
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
    kept: Kept  # how linear images are

    @property
    def seconds(self) -> float:
        """All stages one after the other, s."""
        return sum(self.stage_seconds.values())

    @property
    def total_bytes(self) -> float:
        """Everything that the folder holds at the end."""
        return sum(self.bytes.values())


def forecast(recipe: Recipe, figures: Figures, *, frames: int, workers: int, kept: Kept) -> Forecast:
    """What `frames` frames like the recipe's take. kept: how linear images are."""
    size = shard_size(recipe, frames)
    shards = -(-frames // size)
    each = {
        folder: value for folder, value in figures.frame_bytes.items() if kept is not Kept.NOT or folder != "masters"
    }
    alone = [folder for folder in ("masters", "truth") if each.get(folder)]
    archives = shards if kept is Kept.ARCHIVES and "masters" in alone else 0
    singles = frames * (len(alone) - (1 if archives else 0))
    sizes = {folder: value * frames for folder, value in each.items()} | {"footers": figures.shard_bytes * shards}
    if archives:
        sizes["masters"] += ENTRY_BYTES * frames
    rows = sum(value for folder, value in each.items() if folder not in ("masters", "truth"))
    return Forecast(
        frames=frames,
        shards=shards,
        shard_frames=size,
        files=shards * figures.shard_files + archives + singles,
        bytes=sizes,
        stage_seconds={stage: spent * frames / workers for stage, spent in figures.seconds.items()},
        worker_mb=figures.worker_mb + HELD_TIMES * min(size, frames) * rows / 2**20,
        workers=workers,
        source=figures.source,
        kept=kept,
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
