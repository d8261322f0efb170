"""What is damaged or missing in a dataset made again, and nothing else touched."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Iterable, Sequence
from pathlib import Path

from datasets.errors import UserError
from datasets.schema import TABLES
from datasets.store.dataset import Dataset
from datasets.store.linear_images import MASTERS
from datasets.store.packing import unpack_sound
from datasets.store.quarantine import put_aside
from datasets.store.refusals import SHARD_NAME, refused
from datasets.verify import verify
from datasets.verify.problems import Kind, Problem
from pipelines.detection import Detector
from pipelines.stages import run as stages
from pipelines.stages import score
from pipelines.stages.estimate_images import OWN_SYSTEMS
from pipelines.stages.missing import Execution, Stage, run_missing
from pipelines.stages.settings import CAMERAS, DETECTED_BY, IMAGE, USES, Setting, System

ASIDE = (Kind.DAMAGED, Kind.FOREIGN, Kind.UNPLANNED)  # kinds of files that are put into quarantine
DETECTORS = "|".join(map(re.escape, Detector))
VARIANT = re.compile(  # a name of shards of estimates, as `Setting.name` and `System.shard_name` make it
    rf"(?P<solver>.+)-(?P<points>truth\+(?P<noise>[0-9.e+-]+)px-x(?P<draws>\d+)|truth|{IMAGE}|detected"
    rf"|{DETECTED_BY}(?P<detector>{DETECTORS}))-(?P<camera>{'|'.join(CAMERAS)})-(?P<use>{'|'.join(USES)})"
)


def repair(dataset: Dataset, execution: Execution) -> tuple[list[Path], list[Problem]]:
    """Put aside what is damaged or foreign, and make again what is missing then.

    Returns:
        Where the files lie that were put aside, and what is still wrong.

    Raises:
        UserError: poses of a file are lost, which only that file has; or a stage fails.
    """
    problems = verify(dataset)[1]
    wanted = [_made_by(item.path) for item in problems if item.kind in (Kind.DAMAGED, Kind.FOREIGN, Kind.MISSING)]
    for variant in _variants(wanted, "estimates"):
        answers_of(variant)  # before anything is moved
    for item in problems:
        if item.kind in (Kind.DAMAGED, Kind.FOREIGN) and _is_archive(item.path):
            _unpack(dataset, item.path)
    aside = [put_aside(dataset.root, item.path) for item in problems if item.kind in ASIDE and item.path.is_file()]
    # The manifest is written once at the end: until then it names what is still to be made.
    _make(dataset, [path for path in wanted if path is not None], dataclasses.replace(execution, lists=False))
    dataset.write_manifest()
    return aside, verify(dataset)[1] if problems else []


def answers_of(variant: str) -> Setting | System:
    """What makes the shards of estimates that have a name.

    Raises:
        UserError: they were poses of a file.
    """
    found = VARIANT.fullmatch(variant)
    if found is None:
        raise UserError(f"estimates {variant!r} have a name that no setting makes; put them aside and run repair again")
    solver = found["solver"].replace("@", ":")
    if found["points"] == IMAGE:
        if ":" in solver or solver in OWN_SYSTEMS:
            return System(solver, found["camera"])
        raise UserError(
            f"the poses of {solver!r} came from a file; run `score DIR --poses FILE --name {solver}` with it, and then "
            "repair again"
        )
    setting = Setting(solver, "truth", found["camera"], found["use"])
    if found["noise"]:
        noise, draws = float(found["noise"]), int(found["draws"])
        return dataclasses.replace(setting, points="truth+noise", noise_px=noise, draws=draws)
    if found["detector"]:
        return dataclasses.replace(setting, points="detected", detector=found["detector"])
    return dataclasses.replace(setting, points=found["points"])


def _make(dataset: Dataset, wanted: Sequence[tuple[str, str, Path]], execution: Execution) -> None:
    """Make what is missing of each kind of shard that is wanted, in the order of the stages."""
    if any(table in ("frames", "keypoints") for table, _, _ in wanted):
        stages.run_generate(dataset, execution)
    for variant in _variants(wanted, "detections"):
        stages.run_detect(dataset, execution, Detector.EDGE_FIT if variant == "detections" else variant)
    for variant in _variants(wanted, "estimates"):
        answers = answers_of(variant)
        if isinstance(answers, Setting):
            stages.run_estimate(dataset, [answers], execution)
        else:
            stages.run_system(dataset, answers, execution)
    if any(table == "bounds" for table, _, _ in wanted):
        stages.run_bound(dataset, execution)
    scores = {path.name for table, _, path in wanted if table == "scores"}
    shards = [path for path in dataset.shards("estimates") if path.name in scores]
    if shards:
        run_missing(Stage("score", score.is_done, score.run_shard), dataset, shards, execution)


def _made_by(path: Path) -> tuple[str, str, Path] | None:
    """Table and kind of the shard that a file is or is made with; None for what is made with the others."""
    table, shard = path.parent.name, SHARD_NAME.fullmatch(path.name)
    if table in TABLES and shard:
        return table, shard[1], path
    return ("frames", "frames", path) if path.suffix == ".exr" or _is_archive(path) else None


def _is_archive(path: Path) -> bool:
    return path.parent.name == MASTERS and path.suffix == ".zip"


def _unpack(dataset: Dataset, archive: Path) -> None:
    """Keep what is sound in a damaged archive, from which the next one is made."""
    try:
        unpack_sound(dataset.root, dataset.recipe, archive)
    except OSError as error:
        raise refused(archive, error) from error


def _variants(wanted: Iterable[tuple[str, str, Path] | None], table: str) -> list[str]:
    return list(dict.fromkeys(item[1] for item in wanted if item is not None and item[0] == table))
