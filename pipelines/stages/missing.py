"""A stage over the shards that it has not made yet, with a progress bar."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Generic, TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from datasets.plan import frame_ids_of_shard
from datasets.store.atomic import write_text
from datasets.store.dataset import Dataset
from datasets.store.quarantine import FAILED, QUARANTINE
from pipelines.adapters.limits import DEFAULT, Limits
from pipelines.detection.time_limit import DETECT_SECONDS
from pipelines.engines.engine import Engine, Failure
from pipelines.stages.part import WHOLE, Part

Shard = TypeVar("Shard")


@dataclass(frozen=True, slots=True)
class Stage(Generic[Shard]):
    """What is done to each shard."""

    name: str  # beside the bar and in messages
    is_done: Callable[[Dataset, Shard], bool]
    run_shard: Callable[..., str | None]  # takes dataset and shard; returns what a user's function first failed with
    by_frame: bool = False  # shards are numbers, and `run_shard` takes an `advance` to call after each frame
    hint: str = ""  # what to do where nothing is missing

    def steps(self, dataset: Dataset, shard: Any) -> int:
        """How far a shard moves the bar: by its frames, or by one."""
        return len(frame_ids_of_shard(dataset.recipe, shard)) if self.by_frame else 1


@dataclass(frozen=True, slots=True)
class ShardFailure:
    """A shard that a stage failed to make, twice."""

    stage: str
    index: int
    reason: str
    note: Path  # file with the reason and, of an exception, where it was raised


@dataclass(frozen=True, slots=True)
class Execution:
    """How stages run: where, what they print to, and what part of a dataset they do."""

    engine: Engine
    console: Console
    part: Part = WHOLE
    lists: bool = True  # whether each stage writes the manifest at its end
    limits: Limits = DEFAULT  # of a user's function
    detect_seconds: float = DETECT_SECONDS  # of processor time, for the detection of one picture
    goes_on: bool = False  # whether a shard that fails twice is left out, and noted, instead of ending all
    failures: list[ShardFailure] = field(default_factory=list)  # of the shards that could not be made

    def is_left_out(self, dataset: Dataset, shard: Any) -> bool:
        """Whether a stage before could not make what a shard is made from."""
        index = dataset.index_of(shard) if isinstance(shard, Path) else shard
        return any(failure.index == index for failure in self.failures)


class _Rate(ProgressColumn):
    """Steps per second."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.finished_speed or task.speed or 0.0:.2f}/s")


def run_missing(stage: Stage[Shard], dataset: Dataset, shards: Sequence[Shard], execution: Execution) -> list[str]:
    """Do the missing ones of the part's shards, and return what they noted, in their order.

    Only who does everything writes the manifest at the end: of several at once each would list what it has seen of the
    others.
    """
    shards = [shard for shard in shards if not execution.is_left_out(dataset, shard)]
    missing = [shard for shard in shards if not stage.is_done(dataset, shard)]
    notes: dict[Shard, str | None] = {}
    if missing:
        notes = _run_with_bar(stage, dataset, shards, missing, execution)
    else:
        told = f"all {len(shards)} shards are there{stage.hint}" if shards else "no shard is in this part"
        execution.console.print(f"{stage.name}: {told}")
    if execution.part.is_whole and execution.lists:
        dataset.write_manifest()
    return [note for note in map(notes.get, shards) if note]


def _run_with_bar(
    stage: Stage[Shard], dataset: Dataset, shards: Sequence[Shard], missing: Sequence[Shard], execution: Execution
) -> dict[Shard, str | None]:
    """What each missing shard noted. By frame the bar moves at each frame, in other processes when a shard is whole."""
    engine, steps = execution.engine, {shard: stage.steps(dataset, shard) for shard in shards}
    total, left = sum(steps.values()), sum(steps[shard] for shard in missing)
    notes: dict[Shard, str | None] = {}
    with _progress("frames" if stage.by_frame else "shards", execution.console) as progress:
        bar = progress.add_task(stage.name, total=total, completed=total - left)
        run_one = functools.partial(stage.run_shard, dataset)
        moves_bar = stage.by_frame and engine.runs_here(missing)
        if moves_bar:
            run_one = functools.partial(run_one, advance=functools.partial(progress.advance, bar))
        failed = functools.partial(_note_failure, stage.name, dataset, execution)
        for shard, notes[shard] in engine.map(run_one, missing, failed if execution.goes_on else None):
            progress.advance(bar, 0 if moves_bar else steps[shard])
    return notes


def _note_failure(stage: str, dataset: Dataset, execution: Execution, shard: Any, failure: Failure) -> None:
    """Keep why a shard could not be made, in a file of the quarantine; the run goes on without it."""
    index = dataset.index_of(shard) if isinstance(shard, Path) else shard
    name = re.sub(r"[^A-Za-z0-9._@+-]", "-", stage)
    note = dataset.root / QUARANTINE / FAILED / f"{name}-{index:05d}.txt"
    frames = frame_ids_of_shard(dataset.recipe, index)
    told = f"{stage}, frames {frames[0]} to {frames[-1]}: {failure.reason}"
    write_text(note, f"{told}\n\n{failure.trace}")
    execution.failures.append(ShardFailure(stage, index, told, note))


def _progress(unit: str, console: Console) -> Progress:
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TextColumn(unit), _Rate(),
        TimeRemainingColumn(),
    )  # fmt: skip
    return Progress(*columns, console=console, disable=console.quiet)
