"""Whole systems, from an image to a pose: `photometric`, a user's function, or a file of poses.

Their rows stand in `estimates` beside the solvers': points "image", use "all", draw 0.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from datasets.plan import shard_count
from datasets.rows import decode_image, estimate_rows
from datasets.schema import FRAMES
from datasets.store.dataset import Dataset
from eposit import Camera
from pipelines.adapters.limits import DEFAULT, Limits
from pipelines.adapters.process import Form, function_process
from pipelines.adapters.results import PoseResult, stack
from pipelines.adapters.user import attempt, check_call, load_function
from pipelines.stages.estimate import path_of_shard
from pipelines.stages.settings import ALL, IMAGE, System, assumed
from render.targets.kinds import AnyTarget

OWN_SYSTEMS = {"photometric": "pipelines.photometric:estimate"}  # by the names that tables have

ESTIMATOR_FORM = "(image, camera, target)"

Estimator = Callable[[NDArray[np.uint8], Camera, AnyTarget], Any]


def find_estimator(name: str) -> Estimator:
    """A system of ours by its name, or the user's package.module:function: it takes image, camera and target.

    Raises:
        UserError: it cannot be imported, or does not take three arguments.
    """
    function = load_function(OWN_SYSTEMS.get(name, name), "--estimator")
    check_call(function, f"--estimator {name}", ESTIMATOR_FORM, 3)
    return function


def is_done(dataset: Dataset, index: int, system: System) -> bool:
    """Whether a shard is there."""
    return dataset.is_done(path_of_shard(dataset, index, system.shard_name))


def run_shard(
    dataset: Dataset,
    index: int,
    advance: Callable[[], None] = lambda: None,
    *,
    system: System,
    limits: Limits = DEFAULT,
) -> str | None:
    """Make one shard of `estimates` from the same shard of `frames`; what the function first failed with, if it did.

    The function is called once for each image, (h, w) grey values. advance: called after each frame. limits: of a
    user's function, which runs in a process of its own.
    """
    answer = estimator_of(system.name, limits)
    target = dataset.recipe.target
    path = dataset.shard_path("frames", index, shard_count(dataset.recipe))
    answers: list[PoseResult] = []
    notes: list[str] = []
    frames = dataset.read_shard(path, list(FRAMES.names)).to_pylist()
    for frame in frames:
        frame_id = frame["frame_id"]
        image, camera = np.array(decode_image(frame["image"], path, frame_id)), assumed(frame, system.camera)
        answers.append(answer(_named(frame_id, notes), image, camera, target))
        advance()
    rows = system_rows([frame["frame_id"] for frame in frames], system, answers)
    dataset.write_shard(path_of_shard(dataset, index, system.shard_name), rows)
    return notes[0] if notes else None


def estimator_of(name: str, limits: Limits = DEFAULT) -> Callable[..., PoseResult]:
    """What answers for one image, called with where to tell of a failure, image, camera and target.

    Raises:
        UserError: it cannot be imported, or does not take three arguments.
    """
    if name in OWN_SYSTEMS:
        function = find_estimator(name)
        return lambda tell, *given: attempt(functools.partial(function, *given), f"--estimator {name}", tell)
    return function_process(name, Form("--estimator", ESTIMATOR_FORM, 3), limits).call


def system_rows(frame_ids: Sequence[int], system: System, answers: Sequence[PoseResult]) -> pa.Table:
    """Rows of `estimates`; no points were given, so there is no reprojection error."""
    key = (system.name, IMAGE, system.camera, ALL)
    return estimate_rows(frame_ids, [0] * len(frame_ids), key, stack(answers), 0)


def _named(frame_id: int, notes: list[str]) -> Callable[[str], None]:
    return lambda note: notes.append(f"frame {frame_id}: {note}")
