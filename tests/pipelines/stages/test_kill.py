"""A run that is killed in any stage and started again ends with the content of an undisturbed run."""

from __future__ import annotations

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from datasets.store.dataset import open_dataset
from datasets.verify import verify
from datasets.verify.problems import Kind
from tests.timeless import timeless

STAGES = ("generate", "detect", "estimate", "score", "report")
TABLE = {"generate": "frames", "detect": "detections", "estimate": "estimates", "score": "scores"}
MADE = {"generate": ("frames", "keypoints", "masters"), "report": ("report.html",)}
ATTEMPTS = 5  # a machine may let a stage end before its kill arrives
PATIENCE_S = 60.0
MOMENTS = 30


@pytest.fixture(scope="module")
def finished(tiny, tmp_path_factory):
    """Recipe file, folder and duration (s) of an undisturbed run over four frames."""
    folder = tmp_path_factory.mktemp("kill")
    recipe = folder / "tiny.toml"
    recipe.write_text(tiny[0].replace("step = 90", "step = 30"))
    begin = time.monotonic()
    process = started(recipe, folder / "undisturbed")
    assert process.wait(PATIENCE_S) == 0
    process.stdout.close()
    return recipe, folder / "undisturbed", time.monotonic() - begin


def started(recipe, root, workers=1):
    """`python -m pipelines run` in a process group of its own."""
    words = ["run", recipe, "--out", root, "--workers", workers]
    return subprocess.Popen(
        [sys.executable, "-m", "pipelines", *map(str, words)],
        cwd=Path(__file__).parents[3],
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def kill(process):
    """Kill the process and its workers, whatever they do."""
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()


def before(stage, source, root):
    """A copy of a finished dataset as it is when a stage begins."""
    if stage == "generate":
        return
    shutil.copytree(source, root)
    for name in STAGES[STAGES.index(stage) :]:
        for made in MADE.get(name, (TABLE.get(name),)):
            path = root / made
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def shards(root, stage):
    return list((root / TABLE[stage]).glob("[!.]*"))


def has_begun(stage, process, root):
    """Wait until a stage has finished its first shard; for the report, which has none, until scoring is done."""
    if stage == "report":
        assert any(line.startswith("score: all ") for line in process.stdout)
        return
    end = time.monotonic() + PATIENCE_S
    while not shards(root, stage):
        assert process.poll() is None
        assert time.monotonic() < end
        time.sleep(0.001)


def has_ended(stage, source, root):
    if stage == "report":
        return (root / "report.html").exists()
    return len(shards(root, stage)) == len(shards(source, stage))


def killed_in(stage, finished, folder):
    """A dataset whose run was killed after a stage had begun and before it had ended."""
    recipe, source, _ = finished
    for attempt in range(ATTEMPTS):
        root = folder / str(attempt)
        before(stage, source, root)
        process = started(recipe, root)
        try:
            has_begun(stage, process, root)
        finally:
            kill(process)
        if not has_ended(stage, source, root):
            return root
    raise AssertionError(f"{stage} ended before each of {ATTEMPTS} kills")


def assert_only_missing(root):
    """What is there is sound."""
    _, problems = verify(open_dataset(root))
    assert [problem for problem in problems if problem.kind != Kind.MISSING] == []


def assert_equal(root, source, content):
    assert content(root) == content(source)
    for name in ("recipe.toml", "README.md", "report.html", "manifest.json"):
        assert timeless(root / name) == timeless(source / name)
    assert list(root.rglob(".tmp-*")) == []


@pytest.mark.full
@pytest.mark.parametrize("stage", STAGES)
def test_a_run_killed_in_a_stage_is_resumed(stage, finished, tmp_path, cli, content):
    recipe, source, _ = finished
    root = killed_in(stage, finished, tmp_path)
    assert_only_missing(root)
    assert cli("run", recipe, "--out", root, "--quiet").code == 0
    assert_equal(root, source, content)


@pytest.mark.slow
@pytest.mark.parametrize("number", range(MOMENTS))
def test_a_run_killed_at_any_moment_is_resumed(number, finished, tmp_path, cli, content):
    recipe, source, duration = finished
    root = tmp_path / "dataset"
    process = started(recipe, root, workers=1 + number % 2)
    time.sleep(random.Random(number).uniform(0.0, duration))
    kill(process)
    if (root / "recipe.toml").exists():
        assert_only_missing(root)
    assert cli("run", recipe, "--out", root, "--quiet").code == 0
    assert_equal(root, source, content)
