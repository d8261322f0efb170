"""The stages as steps of a run: which shards are missing, and the progress bar over them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.text import Text

from datasets.plan import frame_count, shard_count
from datasets.store import Dataset
from pipelines import detect, estimate, generate, score
from pipelines.detection import Detector
from pipelines.engine import check_workers, map_shards, runs_here
from pipelines.estimate import Setting

Shard = TypeVar("Shard")

# What `run` estimates: our solver on detected and on true points, and the paper's way with four points.
RUN_SETTINGS = (
    Setting(),
    Setting(points="truth"),
    Setting(use="four"),
    Setting(solver="eposit", use="four"),
    Setting(solver="eposit", use="four", camera="nominal"),
)


class _Rate(ProgressColumn):
    """Steps per second."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.finished_speed or task.speed or 0.0:.2f}/s")


def run_generate(dataset: Dataset, workers: int, console: Console) -> None:
    """Render what is missing."""
    indices = range(shard_count(dataset.recipe))
    _run("generate", dataset, indices, generate.is_done, generate.run_shard, workers, console, by_frame=True)


def run_detect(dataset: Dataset, workers: int, console: Console, detector: str = Detector.EDGE_FIT) -> None:
    """Detect what is missing.

    Raises:
        UserError: an unknown detector.
    """
    detect.check_detector(detector)
    _run(
        "detect" if detector == Detector.EDGE_FIT else f"detect {detector}",
        dataset,
        range(shard_count(dataset.recipe)),
        functools.partial(detect.is_done, detector=detector),
        functools.partial(detect.run_shard, detector=detector),
        workers,
        console,
        by_frame=True,
    )


def run_estimate(dataset: Dataset, settings: Iterable[Setting], workers: int, console: Console) -> None:
    """Estimate what is missing."""
    for setting in settings:
        _run(
            f"estimate {setting.name}",
            dataset,
            range(shard_count(dataset.recipe)),
            functools.partial(estimate.is_done, setting=setting),
            functools.partial(estimate.run_shard, setting=setting),
            workers,
            console,
        )


def run_score(dataset: Dataset, workers: int, console: Console) -> None:
    """Score what is missing.

    Raises:
        UserError: there are no estimates yet.
    """
    dataset.read("estimates", ["frame_id"])
    _run("score", dataset, score.targets(dataset), score.is_done, score.run_shard, workers, console)


def _run(
    name: str,
    dataset: Dataset,
    shards: Sequence[Shard],
    is_done: Callable[[Dataset, Shard], bool],
    run_shard: Callable[..., None],
    workers: int,
    console: Console,
    *,
    by_frame: bool = False,
) -> None:
    """Do the missing shards.

    by_frame: shards are numbers, and `run_shard` takes an `advance` to call after each frame. The bar then counts
    frames; from other processes their shards are told when they are whole.
    """
    check_workers(workers)
    missing = [shard for shard in shards if not is_done(dataset, shard)]
    if not missing:
        console.print(f"{name}: all {len(shards)} shards are there")
        dataset.write_manifest()
        return
    sizes = {shard: _frames_in(dataset, shard) if by_frame else 1 for shard in shards}
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
        TextColumn("frames" if by_frame else "shards"), _Rate(), TimeRemainingColumn(),
    )  # fmt: skip
    with Progress(*columns, console=console, disable=console.quiet) as progress:
        total, left = sum(sizes.values()), sum(sizes[shard] for shard in missing)
        bar = progress.add_task(name, total=total, completed=total - left)
        run_one, told = functools.partial(run_shard, dataset), by_frame and runs_here(missing, workers)
        if told:
            run_one = functools.partial(run_one, advance=functools.partial(progress.advance, bar))
        for shard in map_shards(run_one, missing, workers):
            progress.advance(bar, 0 if told else sizes[shard])
    dataset.write_manifest()


def _frames_in(dataset: Dataset, index: Any) -> int:
    size = dataset.recipe.shard_frames
    return min(size, frame_count(dataset.recipe) - size * index)
