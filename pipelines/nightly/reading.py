"""What a code makes of the pictures of a suite: points, poses, and their measures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pyarrow as pa
from rich.console import Console

from datasets.store.dataset import Dataset, open_dataset
from pipelines.engines.local import LocalEngine
from pipelines.nightly.measures import measure
from pipelines.nightly.other_code import Code
from pipelines.nightly.suites import REPLAYED, copy_pictures, shards_digest
from pipelines.nightly.systems import Function, PoseFile, Systems
from pipelines.stages import run as stages
from pipelines.stages.import_poses import import_poses
from pipelines.stages.missing import Execution
from pipelines.stages.settings import Setting
from render.sensor.presets import regime_of


@dataclass(frozen=True, slots=True)
class Reading:
    """What one code made of a suite."""

    measures: pa.Table
    replayed: dict[str, str]  # setting to the digest of its poses
    left_out: tuple[str, ...] = ()  # a sentence for each file of poses that lacks frames or seems to have another form


@dataclass(frozen=True, slots=True)
class Here:
    """This code, which reads in this process, and the same code in processes of its own for a user's functions."""

    engine: LocalEngine
    console: Console
    code: Code

    def read(self, pictures: Dataset, folder: Path, systems: Systems) -> Reading:
        """Read a suite in a folder that shares its pictures.

        Raises:
            OtherCodeError: a user's function does not run to its end.
        """
        dataset = open_dataset(copy_pictures(pictures, folder))
        execution = Execution(self.engine, self.console)
        stages.run_detect(dataset, execution)
        stages.run_estimate(dataset, systems.settings, execution)
        for function in systems.functions:
            function.run(replace(self.code, limit_s=systems.limit_s), folder, self.engine.workers)
        left_out = _import(dataset, systems.files)
        stages.run_score(dataset, execution)
        return replace(_reading(dataset), left_out=left_out)


@dataclass(frozen=True, slots=True)
class Frozen:
    """Other code: the baseline's, and frozen copies of a user's functions."""

    code: Code
    functions: dict[Function, Path]  # with the folder of its copy
    workers: int

    def read(self, pictures: Dataset, folder: Path, settings: Sequence[Setting], limit_s: float) -> Reading:
        """Read a suite in a folder that shares its pictures. limit_s: that a function may take.

        Raises:
            OtherCodeError: that code failed, as when it does not understand the pictures' tables.
        """
        copy_pictures(pictures, folder)
        common = ("--workers", str(self.workers), "--quiet")
        ours = [("detect", folder, *common), *(("estimate", folder, *_options(item), *common) for item in settings)]
        score = ("score", folder, *common)
        self.code.run_all(ours if self.functions else [*ours, score])
        for function, copy in self.functions.items():
            function.run(with_function(self.code, function, copy, limit_s), folder, self.workers)
        if self.functions:
            self.code.run_all([score])
        return _reading(open_dataset(folder))


def with_function(code: Code, function: Function, copy: Path, limit_s: float) -> Code:
    """A code that finds a user's function in a frozen copy."""
    return replace(code, user=(function.name.partition(":")[0], copy.resolve()), limit_s=limit_s)


def _import(dataset: Dataset, files: Sequence[PoseFile]) -> tuple[str, ...]:
    frames = dataset.read("frames", ["frame_id"]).num_rows
    told: list[str] = []
    for item in files:
        path = item.path(regime_of(dataset.recipe.sensor) or "")
        imported = import_poses(dataset, path, item.system, item.form)
        told += [imported.warning] if imported.warning else []
        if imported.missing:
            told.append(f"{path} has no pose for {imported.missing} of {frames} frames, which count as failures")
    return tuple(told)


def _options(setting: Setting) -> tuple[str, ...]:
    noise = ("--noise-px", repr(setting.noise_px), "--draws", str(setting.draws))
    own = ("--solver", setting.solver, "--points", setting.points, "--camera", setting.camera, "--use", setting.use)
    return own + (noise if setting.points == "truth+noise" else ())


def _reading(dataset: Dataset) -> Reading:
    replayed: dict[str, str] = {}
    for setting in REPLAYED:
        shards = [path for path in dataset.shards("estimates") if path.name.startswith(f"{setting.name}-")]
        if shards:
            replayed[setting.name] = shards_digest(dataset, shards)
    return Reading(measure(dataset), replayed)
