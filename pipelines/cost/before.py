"""What a command that renders says before it starts, and what it refuses: more bytes than the disk can hold."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

from datasets.errors import UserError
from datasets.plan import frame_count
from datasets.recipe.model import Recipe
from datasets.store.kept_masters import Kept, kept_of
from datasets.store.refusals import SHARD_NAME
from datasets.url_path import UrlPath
from pipelines.cost.choice import forecast_of
from pipelines.cost.forecast import Forecast, lasting, sized
from pipelines.stages.missing import Execution

MARGIN = 0.1  # of the bytes that are still to be written: files of later stages, blocks that are partly filled
ALL_STAGES = ("generate", "detect", "estimate", "score")
MADE_BY_GENERATE = ("frames", "keypoints", "masters", "truth")


@dataclass(frozen=True, slots=True)
class Start:
    """What a command is about to do."""

    workers: int
    stages: tuple[str, ...]  # of `ALL_STAGES`
    kept: Kept  # how linear images are to be kept
    ignore_disk: bool = False


@dataclass(frozen=True, slots=True)
class Begun:
    """What is already in a dataset's folder."""

    shards: int  # of frames
    frame_bytes: float | None  # of a picture with its row, None where there are none


def tell_cost(recipe: Recipe, out: Path, execution: Execution, start: Start) -> None:
    """Say in one line what a command is about to take; nothing where every picture is there.

    Raises:
        UserError: the disk cannot hold it, unless `start.ignore_disk`.
    """
    workers = start.workers * execution.part.count
    kept = kept_of(out) if start.kept is Kept.FILES else start.kept
    found = forecast_of(recipe, frames=frame_count(recipe), workers=workers, kept=kept)
    begun = _begun(out, found.shard_frames)
    left = max(0.0, 1.0 - begun.shards / found.shards)
    if not left:
        return
    wanted, free = _bytes_left(found, begun, left, start.stages), free_bytes(out)
    told = f"{round(left * found.frames)} of {found.frames} frames to make, {found.shard_frames} in a shard"
    time = lasting(left * sum(found.stage_seconds[stage] for stage in start.stages))
    people = f"{workers} {'worker' if workers == 1 else 'workers'}"
    size = f"{sized(wanted)} of the {sized(free)} that are free" if free is not None else f"{sized(wanted)} to put"
    execution.console.print(f"{told}: about {time} with {people}, {size} (from {found.source})", soft_wrap=True)
    if free is not None and wanted * (1.0 + MARGIN) > free and not start.ignore_disk:
        raise _too_small(out, wanted, free, kept)


def _too_small(out: Path, wanted: float, free: int, kept: Kept) -> UserError:
    leaner = "" if kept is Kept.NOT else ", leave out the linear images with --no-masters"
    return UserError(
        f"{out} needs about {sized(wanted)} more, {sized(wanted * (1.0 + MARGIN))} with a margin of {MARGIN:.0%}, and "
        f"its disk has {sized(free)} free; free space, choose another --out{leaner}, or go on with --ignore-disk"
    )


def free_bytes(folder: Path) -> int | None:
    """Bytes that this user may still write where a folder is, or will be; None of an object store."""
    if isinstance(folder, UrlPath):
        return None
    there = folder.absolute()
    while not there.exists():
        there = there.parent
    return shutil.disk_usage(there).free


def _bytes_left(found: Forecast, begun: Begun, left: float, stages: tuple[str, ...]) -> float:
    """Bytes of the frames that are not there; pictures count as large as those that are."""
    kinds = found.bytes if "detect" in stages else {name: found.bytes.get(name, 0.0) for name in MADE_BY_GENERATE}
    sizes = dict(kinds)
    if begun.frame_bytes is not None:
        sizes["frames"] = begun.frame_bytes * found.frames
    return left * sum(sizes.values()) + _bytes_of_packing(found)


def _bytes_of_packing(found: Forecast) -> float:
    """Of the linear images that are there twice for a moment: those of the shards that workers pack at once."""
    at_once = min(found.shards, found.workers) * found.shard_frames / found.frames
    return min(1.0, at_once) * found.bytes["masters"] if found.kept is Kept.ARCHIVES else 0.0


def _begun(out: Path, size: int) -> Begun:
    """size: frames of a shard."""
    folder = out / "frames"
    if isinstance(folder, UrlPath):
        sizes = folder.sizes()
    else:
        sizes = {path.name: path.stat().st_size for path in folder.glob("*.parquet")}
    held = [count for name, count in sizes.items() if SHARD_NAME.fullmatch(name)]
    return Begun(len(held), sum(held) / (len(held) * size) if held else None)
