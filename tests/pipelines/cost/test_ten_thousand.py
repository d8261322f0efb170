"""Ten thousand small frames through every stage in one process: memory and throughput from the first to the last."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path

import pytest
from rich.console import Console

from datasets.plan import shard_count
from datasets.recipe.model import parse_recipe
from datasets.store.atomic import write_text
from datasets.store.claim import claim
from datasets.store.kept_masters import Kept
from datasets.verify import verify
from pipelines.bench.memory import resident_mb
from pipelines.machine import processor
from pipelines.stages import run as stages
from pipelines.stages.missing import Execution
from pipelines.stages.settings import run_settings

PAGE = Path(__file__).resolve().parents[3] / "docs" / "evidence" / "scale.md"
MOST_GROWTH_MB = 50.0
RECIPE = """\
name = "ten-thousand"
seed = 3
samples = 4
shard_frames = 1000

[target]
pattern = "plain_chessboard"
columns = 5
rows = 4

[trajectory]
kind = "scatter"
count = 10000
depth_range_mm = [900, 1100]
offset_range_mm = [0, 50]

[[cameras]]
name = "small"
lens = "perspective"
fx = 150
fy = 150
cx = 79.5
cy = 59.5
width = 160
height = 120
"""
TEXT = """\
# Ten thousand frames

`python -m pytest -m slow tests/pipelines/cost/test_ten_thousand.py` writes this page: {frames} frames of 160 x 120 px
with a plain chessboard, in {shards} shards of a thousand, through every stage of `run` in one process that keeps no
linear images. Processor time is that of the process for a thousand frames, so that other work on the machine weighs
little in it; memory is what is resident after each thousand. {machine}, Python {python}, {day}.

{rows}

The last thousand frames took {ratio} of the processor time of the first, all stages together; a stage's own first
thousand loads and compiles what it needs. Memory grew by {growth:+.0f} MB from the first thousand frames of `generate`
to the last of `score`, by {own:+.0f} MB at most within a stage. Writing the manifest, at the end of each stage, is in
none of the rows; it reads the footers of new shards only. `verify` passes what was made.

`report` in a process of its own goes through the shards and keeps a few numbers of each frame. It had {few:.0f} MB at
most with a thousand frames of this kind and {all:.0f} MB with all of them: {more:+.0f} MB.
"""


@dataclass
class Watched:
    """An engine in this process that notes what each shard took: stage by stage in their order."""

    notes: list[list[tuple[float, float]]] = field(default_factory=list)  # processor time, s, and memory after it, MB

    workers = 1

    def runs_here(self, tasks):
        return True

    def map(self, run_one, tasks, failed=None) -> Iterator[tuple[object, object]]:
        self.notes.append([])
        for task in tasks:
            began = time.process_time()
            result = run_one(task)
            self.notes[-1].append((time.process_time() - began, resident_mb()))
            print(len(self.notes), *(f"{value:.1f}" for value in self.notes[-1][-1]), flush=True)
            yield task, result


@pytest.mark.slow
def test_memory_stays_and_the_last_thousand_frames_are_as_fast_as_the_first(tmp_path):
    recipe, engine = parse_recipe(RECIPE, "test"), Watched()
    execution = Execution(engine, Console(quiet=True))
    settings = run_settings(recipe.target)
    dataset = made(tmp_path / "out", RECIPE, execution)
    assert verify(dataset)[1] == []
    fewer = RECIPE.replace("count = 10000", "count = 1000")
    few = made(tmp_path / "few", fewer, Execution(Watched(), execution.console))
    peaks = [report_peak_mb(each.root) for each in (few, dataset)]
    shards = shard_count(recipe)
    names = ["generate", "detect", *(f"estimate {setting.name}" for setting in settings), "score"]
    found = dict(zip(names, engine.notes, strict=True))
    score = found.pop("score")  # of every kind of estimate, one after the other
    for i, setting in enumerate(settings):
        found[f"score {setting.name}"] = score[i * shards : (i + 1) * shards]
    own = max(notes[-1][1] - notes[0][1] for notes in found.values())
    growth = score[-1][1] - found["generate"][0][1]
    write_text(PAGE, _page(found, growth, own, shards, peaks))
    assert own < MOST_GROWTH_MB
    assert peaks[1] - peaks[0] < MOST_GROWTH_MB


def made(root, text, execution):
    """A dataset after every stage but the report."""
    recipe = parse_recipe(text, "test")
    with claim(root, recipe, text, kept=Kept.NOT) as dataset:
        stages.run_generate(dataset, execution)
        stages.run_detect(dataset, execution)
        stages.run_estimate(dataset, run_settings(recipe.target), execution)
        stages.run_score(dataset, execution)
    return dataset


def report_peak_mb(root):
    """The most memory that writing a dataset's report takes, MB."""
    running = subprocess.Popen([sys.executable, "-m", "pipelines", "report", str(root)])
    _, status, used = os.wait4(running.pid, 0)
    assert status == 0
    return used.ru_maxrss / 1024.0


def _page(found, growth, own, shards, peaks) -> str:
    rows = ["| stage | first thousand, s | second, s | last, s | memory after the first, MB | after the last, MB |"]
    rows.append("|---|--:|--:|--:|--:|--:|")
    for name, notes in found.items():
        spent = " | ".join(f"{notes[i][0]:.1f}" for i in (0, 1, -1))
        rows.append(f"| {name} | {spent} | {notes[0][1]:.0f} | {notes[-1][1]:.0f} |")
    first, last = (sum(notes[i][0] for notes in found.values()) for i in (0, -1))
    return TEXT.format(
        frames=1000 * shards,
        shards=shards,
        machine=processor(),
        python=platform.python_version(),
        day=date.today().isoformat(),
        rows="\n".join(rows),
        ratio=f"{last / first:.3f}",
        growth=growth,
        own=own,
        few=peaks[0],
        all=peaks[1],
        more=peaks[1] - peaks[0],
    )
