"""End to end: every stage on a temporary dataset, against the 64 primary rays of the same frames."""

from __future__ import annotations

import functools
import json
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from datasets.plan import plan, shard_count
from datasets.recipe.model import Recipe
from datasets.store.claim import claim
from datasets.store.dataset import Dataset
from pipelines.bench.cases import chosen_poses
from pipelines.bench.primary_rays import NAME, primary_rays
from pipelines.bench.table import Row, compared
from pipelines.detection import Detector
from pipelines.stages import detect, estimate, generate, score
from pipelines.stages.settings import Setting
from pipelines.timing import Times, in_turn, summary, timed

PART = "end to end"
SETTING = Setting()


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """One row for all stages together, and one for each."""
    recipe = by_pose(recipe)
    chosen = chosen_poses(recipe, poses)
    frames = [frame for frame in plan(recipe) if frame.pose_id in chosen]
    spent: dict[str, list[Times]] = {}
    own, floor = in_turn(
        functools.partial(run_stages, recipe, chosen, spent),
        lambda: [primary_rays(recipe, frame) for frame in frames],
    )
    yield compared(PART, "all stages, a frame", own, NAME, floor, len(frames))
    for name, times in spent.items():
        own = summary(times[1:])  # the first round warms up
        yield compared(PART, f"of which {name}", own, NAME, floor, len(frames))


def by_pose(recipe: Recipe) -> Recipe:
    """The recipe with one pose in a shard, so that a shard's number is the pose's."""
    return recipe.model_copy(update={"shard_frames": len(recipe.cameras)})


def run_stages(recipe: Recipe, poses: list[int], spent: dict[str, list[Times]] | None = None) -> None:
    """Generate, detect, estimate with our solver, score, write: some poses of a recipe from `by_pose`.

    spent: takes the times of each stage.
    """
    text = json.dumps(recipe.model_dump(mode="json"))  # what the manifest keeps; nothing reads it again
    with tempfile.TemporaryDirectory() as folder, claim(Path(folder), recipe, text) as dataset:

        def estimate_shard(pose: int) -> None:
            estimate.run_shard(dataset, pose, SETTING)

        def score_shard(pose: int) -> None:
            score.run_shard(dataset, dataset.shard_path("estimates", pose, shard_count(recipe), SETTING.name))

        steps: list[tuple[str, Callable[[int], object]]] = [
            ("generate", lambda pose: generate.run_shard(dataset, pose)),
            ("detect", lambda pose: detect.run_shard(dataset, pose, detector=Detector.EDGE_FIT)),
            ("estimate", estimate_shard),
            ("score", score_shard),
        ]
        for name, step in steps:
            _, times = timed(functools.partial(_run_step, dataset, step, poses))
            if spent is not None:
                spent.setdefault(name, []).append(times)


def _run_step(dataset: Dataset, step: Callable[[int], object], poses: list[int]) -> None:
    for pose in poses:
        step(pose)
    dataset.write_manifest()
