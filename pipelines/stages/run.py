"""The stages as steps of a run."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from datasets.plan import frame_count, shard_count
from datasets.store.dataset import Dataset
from eposit import Status
from pipelines.adapters.process import end_function_process
from pipelines.detection import Detector
from pipelines.endings import printable
from pipelines.stages import detect, estimate, generate, score
from pipelines.stages import estimate_images as systems
from pipelines.stages.import_poses import import_poses
from pipelines.stages.kernels import compiled_ahead, wait_for
from pipelines.stages.missing import Execution, Stage, run_missing
from pipelines.stages.pose_formats import TABLE
from pipelines.stages.settings import Setting, System, check_detector, check_target

if TYPE_CHECKING:
    from pipelines.detection.prepare import Kernels

MAKE_AGAIN = "; --overwrite makes them again"


def run_generate(dataset: Dataset, execution: Execution) -> None:
    """Render what is missing."""
    generate.finish_packing(dataset)
    stage = Stage("generate", generate.is_done, generate.run_shard, by_frame=True)
    run_missing(stage, dataset, _indices(dataset, execution), execution)


def run_detect(
    dataset: Dataset, execution: Execution, detector: str = Detector.EDGE_FIT, kernels: Kernels | None = None
) -> None:
    """Detect what is missing, once the compiled functions are ready: then no two workers compile the same.

    Provisional shards are made again, and what was made from them is removed. Pictures that took too long are told.

    kernels: the compiled functions, if they have been begun before.
    Raises:
        UserError: an unknown detector, or one that does not find this kind of target.
    """
    check_detector(detector)
    check_target(detector, dataset.recipe.target)
    with compiled_ahead(dataset, execution.part, detector, kernels) as needed:
        wait_for(needed, execution.console)
    stage = Stage(
        "detect" if detector == Detector.EDGE_FIT else f"detect {detector}",
        functools.partial(detect.is_done, detector=detector),
        functools.partial(detect.run_shard, detector=detector, seconds=execution.detect_seconds),
        by_frame=True,
    )
    for index in _indices(dataset, execution):
        if detect.is_provisional(dataset, index, detector):
            _forget_estimates(dataset, index, detector)
    late = run_missing(stage, dataset, _indices(dataset, execution), execution)
    if late:
        told = f"{late[0]}{f' and those of {len(late) - 1} more shards' if late[1:] else ''}"
        print(
            f"{stage.name}: {told} took more than {execution.detect_seconds:g} s of processor time twice and have the "
            "status too_late; the same command tries them again, --detect-seconds gives them more",
            file=sys.stderr,
        )


def run_estimate(
    dataset: Dataset, settings: Iterable[Setting], execution: Execution, *, overwrite: bool = False
) -> None:
    """Estimate what is missing. overwrite: what is there as well, for a function that has changed.

    Raises:
        UserError: a user's function that cannot be imported, called or understood.
    """
    for setting in settings:
        stage = Stage(
            f"estimate {setting.name}",
            functools.partial(estimate.is_done, setting=setting),
            functools.partial(estimate.run_shard, setting=setting, limits=execution.limits),
            hint=MAKE_AGAIN,
        )
        check = functools.partial(estimate.solver_of, setting.solver, limits=execution.limits)
        _run_answers(stage, dataset, setting.name, execution, check if overwrite else None)


def run_system(dataset: Dataset, system: System, execution: Execution, *, overwrite: bool = False) -> None:
    """Give every missing image to a whole system, ours or a user's; `overwrite` and errors as `run_estimate`."""
    stage = Stage(
        f"estimate {system.shard_name}",
        functools.partial(systems.is_done, system=system),
        functools.partial(systems.run_shard, system=system, limits=execution.limits),
        by_frame=True,
        hint=MAKE_AGAIN,
    )
    check = functools.partial(systems.estimator_of, system.name, execution.limits)
    _run_answers(stage, dataset, system.shard_name, execution, check if overwrite else None)


def run_bound(dataset: Dataset, execution: Execution) -> None:
    """Compute the pixels' bounds that are missing."""
    from pipelines.stages import bound

    stage = Stage("bound", bound.is_done, bound.run_shard, by_frame=True)
    run_missing(stage, dataset, _indices(dataset, execution), execution)


def run_import(dataset: Dataset, path: Path, system: System, execution: Execution, pose_format: str = TABLE) -> None:
    """Take another system's poses from a file; tell how many frames it left out, and a likely mistake in their form.

    pose_format: of `pose_formats.FORMATS`.
    Raises:
        UserError: a format, name, file or pose that is not usable.
    """
    told = import_poses(dataset, path, system, pose_format)
    if told.warning:
        print(printable(f"warning: {told.warning}"), file=sys.stderr)
    if told.missing:
        text = f"{path} has no pose for {told.missing} of {frame_count(dataset.recipe)} frames; they count as failures"
        execution.console.print(text, soft_wrap=True)


def run_score(dataset: Dataset, execution: Execution) -> None:
    """Score what is missing.

    Raises:
        UserError: there are no estimates yet.
    """
    indices = _indices(dataset, execution)
    shards = score.targets(dataset, indices)
    if not execution.failures and (execution.part.is_whole or (indices and not shards)):
        for _ in dataset.each_shard("estimates", ["frame_id"]):
            pass  # which refuses estimates that are not whole
    run_missing(Stage("score", score.is_done, score.run_shard), dataset, shards, execution)


def _forget_estimates(dataset: Dataset, index: int, detector: str) -> None:
    """Remove the estimates, with their scores, that were made from a shard of detections."""
    source = Setting(detector=detector).points_name
    for path in dataset.shards("estimates"):
        if (
            dataset.index_of(path) == index
            and source in dataset.read_shard(path, ["point_source"])["point_source"].to_pylist()
        ):
            score.forget(dataset, path)
            dataset.remove_shard(path)


def _indices(dataset: Dataset, execution: Execution) -> range:
    """Numbers of the shards that are to be made."""
    return execution.part.indices(shard_count(dataset.recipe))


def _run_answers(
    stage: Stage[int], dataset: Dataset, name: str, execution: Execution, overwrite: Callable[[], object] | None
) -> None:
    """Make the shards of estimates that have a name, and tell how often a user's function failed.

    overwrite: what checks the function before what is there is removed; None leaves what is there.
    """
    indices = _indices(dataset, execution)
    paths = [estimate.path_of_shard(dataset, index, name) for index in indices]
    try:
        if overwrite is not None:
            overwrite()
            for path in paths:
                score.forget(dataset, path)
                dataset.remove_shard(path)
        notes = run_missing(stage, dataset, indices, execution)
    finally:
        end_function_process()
    _tell_failures(stage.name, dataset, [path for path in paths if dataset.is_done(path)], notes)


def _tell_failures(name: str, dataset: Dataset, paths: Sequence[Path], notes: Sequence[str]) -> None:
    failed = rows = 0
    for path in paths:
        status = dataset.read_shard(path, ["status"])["status"].to_pylist()
        failed, rows = failed + status.count(Status.SOLVER_ERROR), rows + len(status)
    if failed:
        first = f"; {notes[0]}" if notes else ""
        print(f"{name}: {failed} of {rows} rows have the status solver_error{first}", file=sys.stderr)
