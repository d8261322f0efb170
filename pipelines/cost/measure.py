"""A few frames of a recipe made in a temporary folder, through every stage of `run`, and what they took."""

from __future__ import annotations

import datetime
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pyarrow.parquet as pq

from datasets.plan import frame_count, frame_ids_of_shard, shard_count
from datasets.recipe.model import Recipe
from datasets.store.dataset import Dataset
from pipelines.cost.figures import IMAGES, TABLES_OF_RUN, Figures
from pipelines.detection import Detector
from pipelines.stages import detect, estimate, generate, score
from pipelines.stages.settings import run_settings

SHARD = 8  # frames that are measured together
SLOW_S = 20.0  # a first shard that takes longer is the measured one: what is done once no longer weighs in it


def measure(recipe: Recipe) -> Figures:
    """What a frame of the recipe takes: of a shard of eight, after another that warms up.

    Raises:
        UserError: a frame cannot be made.
    """
    small = recipe.model_copy(update={"shard_frames": min(SHARD, frame_count(recipe))})
    shards = shard_count(small)
    began = time.process_time()
    first = _of_shard(small, shards // 3)
    return first if time.process_time() - began > SLOW_S else _of_shard(small, 2 * shards // 3)


def _of_shard(small: Recipe, index: int) -> Figures:
    with tempfile.TemporaryDirectory() as folder:
        dataset = Dataset(Path(folder), small)
        seconds = {name: _spent(step) for name, step in _steps(dataset, index)}
        return _figures(dataset, seconds, len(frame_ids_of_shard(small, index)))


def _steps(dataset: Dataset, index: int) -> Iterator[tuple[str, Callable[[], object]]]:
    """The stages of `run` on one shard."""
    yield "generate", lambda: generate.run_shard(dataset, index)
    yield "detect", lambda: detect.run_shard(dataset, index, detector=Detector.EDGE_FIT)
    settings = run_settings(dataset.recipe.target)
    yield "estimate", lambda: [estimate.run_shard(dataset, index, setting) for setting in settings]
    yield "score", lambda: [score.run_shard(dataset, path) for path in dataset.shards("estimates")]


def _spent(step: Callable[[], object]) -> float:
    began = time.process_time()
    step()
    return time.process_time() - began


def _figures(dataset: Dataset, seconds: dict[str, float], frames: int) -> Figures:
    shards = {table: dataset.shards(table) for table in TABLES_OF_RUN}
    rows = {table: sum(map(_compressed, paths)) / frames for table, paths in shards.items()}
    files = [path for paths in shards.values() for path in paths]
    footers = sum(path.stat().st_size for path in files) - frames * sum(rows.values())
    for folder in IMAGES:
        rows[folder] = sum(path.stat().st_size for path in (dataset.root / folder).glob("*.exr")) / frames
    each = {name: spent / frames for name, spent in seconds.items()}
    told = f"{frames} frames measured on this machine, {datetime.date.today().isoformat()}"
    return Figures(each, rows, footers, len(files), _resident_peak_mb(), told)


def _compressed(path: Path) -> int:
    """Bytes of a shard's values, without what stands in it once."""
    footer = pq.read_metadata(path)
    groups = (footer.row_group(i) for i in range(footer.num_row_groups))
    return sum(group.column(i).total_compressed_size for group in groups for i in range(group.num_columns))


def _resident_peak_mb() -> float:
    unit = 1 if sys.platform == "darwin" else 1024  # macOS tells bytes, Linux kilobytes
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit / 2**20
