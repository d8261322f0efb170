"""Whether a long run grows: resident memory of one process that generates and detects frame after frame."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

from datasets.plan import frames_of_shard, shard_count
from datasets.recipe.model import Recipe
from datasets.store.dataset import Dataset
from pipelines.bench.cases import scaled
from pipelines.bench.table import Figure, Row
from pipelines.detection import Detector
from pipelines.stages import detect, generate

PART = "memory"
SETTLED = 200  # frames after which kernels, maps and pools are all there
SCALE = 0.5  # of the recipe's resolution


def measure(recipe: Recipe, frames: int, advance: Callable[[int], None] = lambda frames: None) -> Iterator[Row]:
    """Resident memory after SETTLED frames and at the end, MB, and the growth between.

    advance: called with the number of frames after each shard.
    """
    small = scaled(recipe, SCALE)
    done, settled = 0, None
    while done < frames:
        with tempfile.TemporaryDirectory() as folder:
            dataset = Dataset(Path(folder), small)
            for index in range(shard_count(small)):
                generate.run_shard(dataset, index)
                detect.run_shard(dataset, index, detector=Detector.EDGE_FIT)
                made = len(frames_of_shard(small, index))
                done += made
                advance(made)
                if settled is None and done >= SETTLED:
                    settled = (done, resident_mb())
                if done >= frames:
                    break
    first, before = settled or (done, resident_mb())
    after = resident_mb()
    yield Figure(PART, f"resident after {first} frames", f"{before:.0f} MB")
    yield Figure(PART, f"resident after {done} frames", f"{after:.0f} MB", "", f"{after - before:+.1f} MB")


def resident_mb() -> float:
    """Resident memory of this process, MB of 2**20 bytes."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20
