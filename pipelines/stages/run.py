"""The stages as steps of a run: which shards are missing, and the progress bar over them."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from datasets.plan import frame_count, frames_of_shard, shard_count
from datasets.store.dataset import Dataset
from eposit import Status
from pipelines.adapters.registry import find_solver
from pipelines.detection import Detector
from pipelines.detection.prepare import Kernels
from pipelines.engines.engine import Engine
from pipelines.stages import detect, estimate, generate, score
from pipelines.stages import estimate_images as systems
from pipelines.stages.estimate_images import find_estimator
from pipelines.stages.import_poses import import_poses
from pipelines.stages.kernels import compiled_ahead, wait_for
from pipelines.stages.part import WHOLE, Part
from pipelines.stages.settings import Setting, System, check_detector

Shard = TypeVar("Shard")


class _Rate(ProgressColumn):
    """Steps per second."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.finished_speed or task.speed or 0.0:.2f}/s")


def run_generate(dataset: Dataset, engine: Engine, console: Console, part: Part = WHOLE) -> None:
    """Render what is missing."""
    indices = part.indices(shard_count(dataset.recipe))
    _run("generate", dataset, indices, generate.is_done, generate.run_shard, engine, console, part, by_frame=True)


def run_detect(
    dataset: Dataset,
    engine: Engine,
    console: Console,
    detector: str = Detector.EDGE_FIT,
    part: Part = WHOLE,
    kernels: Kernels | None = None,
) -> None:
    """Detect what is missing, once the compiled functions are ready: then no two workers compile the same.

    kernels: the compiled functions, if they have been begun before.
    Raises:
        UserError: an unknown detector.
    """
    check_detector(detector)
    with compiled_ahead(dataset, part, detector, kernels) as needed:
        wait_for(needed, console)
    _run(
        "detect" if detector == Detector.EDGE_FIT else f"detect {detector}",
        dataset,
        part.indices(shard_count(dataset.recipe)),
        functools.partial(detect.is_done, detector=detector),
        functools.partial(detect.run_shard, detector=detector),
        engine,
        console,
        part,
        by_frame=True,
    )


def run_estimate(
    dataset: Dataset,
    settings: Iterable[Setting],
    engine: Engine,
    console: Console,
    part: Part = WHOLE,
    *,
    overwrite: bool = False,
) -> None:
    """Estimate what is missing. overwrite: what is there as well, for a function that has changed.

    Raises:
        UserError: a user's function that cannot be imported, called or understood.
    """
    for setting in settings:
        find_solver(setting.solver)
        is_done = functools.partial(estimate.is_done, setting=setting)
        run_shard = functools.partial(estimate.run_shard, setting=setting)
        _run_answers(dataset, setting.name, is_done, run_shard, engine, console, part, overwrite=overwrite)


def run_system(
    dataset: Dataset, system: System, engine: Engine, console: Console, part: Part = WHOLE, *, overwrite: bool = False
) -> None:
    """Give every image that is missing to a user's whole system; `overwrite` and errors as `run_estimate`."""
    find_estimator(system.name)
    is_done = functools.partial(systems.is_done, system=system)
    run_shard = functools.partial(systems.run_shard, system=system)
    name = system.shard_name
    _run_answers(dataset, name, is_done, run_shard, engine, console, part, overwrite=overwrite, by_frame=True)


def run_import(dataset: Dataset, path: Path, system: System, console: Console) -> None:
    """Take another system's poses from a file, and tell how many frames it left out.

    Raises:
        UserError: a name, file or pose that is not usable.
    """
    missing = import_poses(dataset, path, system)
    if missing:
        text = f"{path} has no pose for {missing} of {frame_count(dataset.recipe)} frames; they count as failures"
        console.print(text, soft_wrap=True)


def _run_answers(
    dataset: Dataset,
    name: str,
    is_done: Callable[[Dataset, int], bool],
    run_shard: Callable[..., str | None],
    engine: Engine,
    console: Console,
    part: Part,
    *,
    overwrite: bool,
    by_frame: bool = False,
) -> None:
    """Make the shards of estimates that have a name, and tell how often a user's function failed."""
    indices = part.indices(shard_count(dataset.recipe))
    paths = [estimate.path_of_shard(dataset, index, name) for index in indices]
    if overwrite:
        for path in paths:
            score.forget(dataset, path)
            dataset.remove_shard(path)
    hint = "; --overwrite makes them again"
    notes = _run(
        f"estimate {name}", dataset, indices, is_done, run_shard, engine, console, part, by_frame=by_frame, hint=hint
    )
    status = [text for path in paths for text in dataset.read_shard(path, ["status"])["status"].to_pylist()]
    failed = status.count(Status.SOLVER_ERROR)
    if failed:
        first = f"; {notes[0]}" if notes else ""
        print(f"estimate {name}: {failed} of {len(status)} rows have the status solver_error{first}", file=sys.stderr)


def run_score(dataset: Dataset, engine: Engine, console: Console, part: Part = WHOLE) -> None:
    """Score what is missing.

    Raises:
        UserError: there are no estimates yet.
    """
    indices = part.indices(shard_count(dataset.recipe))
    shards = score.targets(dataset, indices)
    if part.is_whole or (indices and not shards):
        dataset.read("estimates", ["frame_id"])
    _run("score", dataset, shards, score.is_done, score.run_shard, engine, console, part)


def _run(
    name: str,
    dataset: Dataset,
    shards: Sequence[Shard],
    is_done: Callable[[Dataset, Shard], bool],
    run_shard: Callable[..., str | None],
    engine: Engine,
    console: Console,
    part: Part,
    *,
    by_frame: bool = False,
    hint: str = "",
) -> list[str]:
    """Do the missing shards, and return what they noted, in their order.

    part: what `shards` are of the dataset. Only who does everything writes the manifest at the end: of several at once
    each would list what it has seen of the others.
    by_frame: shards are numbers, and `run_shard` takes an `advance` to call after each frame. The bar then counts
    frames; from other processes their shards are told when they are whole.
    """
    missing = [shard for shard in shards if not is_done(dataset, shard)]
    if not missing:
        told = f"all {len(shards)} shards are there{hint}" if shards else "no shard is in this part"
        console.print(f"{name}: {told}")
        _finish(dataset, part)
        return []
    sizes = {shard: _frames_in(dataset, shard) if by_frame else 1 for shard in shards}
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
        TextColumn("frames" if by_frame else "shards"), _Rate(), TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=console, disable=console.quiet) as progress:
        total, left = sum(sizes.values()), sum(sizes[shard] for shard in missing)
        bar = progress.add_task(name, total=total, completed=total - left)
        run_one, told = functools.partial(run_shard, dataset), by_frame and engine.runs_here(missing)
        if told:
            run_one = functools.partial(run_one, advance=functools.partial(progress.advance, bar))
        notes: dict[Shard, str | None] = {}
        for shard, notes[shard] in engine.map(run_one, missing):
            progress.advance(bar, 0 if told else sizes[shard])
    _finish(dataset, part)
    return [note for note in map(notes.get, shards) if note]


def _finish(dataset: Dataset, part: Part) -> None:
    if part.is_whole:
        dataset.write_manifest()


def _frames_in(dataset: Dataset, index: Any) -> int:
    return len(frames_of_shard(dataset.recipe, index))
