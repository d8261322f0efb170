"""Two commands at once on one folder: one waits or is refused with a sentence, and nothing is lost.

`TRIES=50 python -m pytest -m slow tests/pipelines/stages/test_two_at_once.py` tries each pair fifty times;
`--junitxml FILE` tells for every try which command came second, after how many seconds, and how both ended.
"""

from __future__ import annotations

import os
import random
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pytest

from datasets.recipe.model import load_recipe
from datasets.store.dataset import open_dataset
from datasets.verify import verify
from datasets.verify.problems import Kind
from tests.conftest import command
from tests.wrong_input import assert_one_sentence, files, left_behind

pytestmark = pytest.mark.slow

TRIES = int(os.environ.get("TRIES", "20"))
PATIENCE_S = 300.0
SHORT = 0.3  # of a whole run: what `estimate` takes, and a run that has rendered and detected, so that they overlap
POSIT = ("--solver", "posit", "--points", "truth", "-q")


@pytest.fixture(scope="module")
def smoke(tmp_path_factory):
    """Two recipes, the folders of their finished datasets, and how long (s) a run takes in a process of its own."""
    folder = tmp_path_factory.mktemp("smoke")
    recipes = folder / "a.toml", folder / "b.toml"
    text = load_recipe("smoke")[1]
    recipes[0].write_text(text)
    recipes[1].write_text(text.replace("seed = 0", "seed = 1"))
    assert command("run", recipes[1], "--out", folder / "b", "-q") == 0  # first, as it compiles what is not yet kept
    begin = time.monotonic()
    assert ended(started("run", recipes[0], "--out", folder / "a", "-q"))[0] == 0
    duration = time.monotonic() - begin
    return recipes, (folder / "a", folder / "b"), duration


def started(*words):
    return subprocess.Popen(
        [sys.executable, "-m", "pipelines", *map(str, words)],
        cwd=Path(__file__).parents[3], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def ended(process):
    """Exit code and what it said on stderr."""
    err = process.communicate(timeout=PATIENCE_S)[1]
    return process.returncode, err


def at_once(commands, name, number, longest, record):
    """Both commands, the second after a random time (s) up to `longest`; exit codes in the order of `commands`."""
    rng = random.Random(f"{name} {number}")
    order, delay = rng.sample(range(2), 2), rng.uniform(0.0, longest)
    processes = {order[0]: started(*commands[order[0]])}
    time.sleep(delay)
    overlapped = processes[order[0]].poll() is None
    processes[order[1]] = started(*commands[order[1]])
    ends = [ended(processes[which]) for which in range(2)]
    codes = [code for code, _ in ends]
    record("try", f"{name}: second {order[1]}, after {delay:.2f} s, overlapped {overlapped}, ended {codes}")
    for code, err in ends:
        if code:
            assert_one_sentence(code, err, "")
    assert 0 in codes
    return codes, [err for _, err in ends]


def assert_sound(root, before):
    """Every shard and linear image that is there is sound, and what was there before still is as it was."""
    _, problems = verify(open_dataset(root))
    assert [problem for problem in problems if problem.kind != Kind.MISSING] == []
    kept = {path: found for path, found in before.items() if path.suffix in (".parquet", ".exr")}
    assert kept.items() <= files(root).items()
    assert left_behind(root) == []


@pytest.mark.parametrize("number", range(TRIES))
def test_two_runs_of_one_recipe(number, smoke, tmp_path, content, record_property):
    (recipe, _), (source, _), duration = smoke
    root = tmp_path / "dataset"
    run = ("run", recipe, "--out", root, "-q")
    _, errs = at_once([run, run], "same", number, duration, record_property)
    assert all(not err or f"{root} is being written by" in err for err in errs)
    assert_sound(root, {})
    assert content(root) == content(source)  # whoever ended well has made it whole
    assert (root / "report.html").read_bytes() == (source / "report.html").read_bytes()


@pytest.mark.parametrize("number", range(TRIES))
def test_two_runs_of_different_recipes(number, smoke, tmp_path, content, record_property):
    recipes, sources, duration = smoke
    root = tmp_path / "dataset"
    runs = [("run", recipe, "--out", root, "-q") for recipe in recipes]
    codes, errs = at_once(runs, "different", number, duration, record_property)
    assert sorted(codes) == [0, 2]
    assert any(words in "".join(errs) for words in ("holds a dataset of another recipe", "is being written by"))
    winner = codes.index(0)
    assert_sound(root, {})
    assert content(root) == content(sources[winner])
    assert (root / "recipe.toml").read_bytes() == recipes[winner].read_bytes()


@pytest.mark.parametrize("number", range(TRIES))
def test_a_run_beside_estimate(number, smoke, tmp_path, content, record_property):
    (recipe, _), (source, _), duration = smoke
    root, alone = tmp_path / "dataset", tmp_path / "alone"
    for folder in (root, alone):
        shutil.copytree(source, folder)
    for table in ("estimates", "scores"):  # what the run has left to do
        shutil.rmtree(root / table)
    before = files(root)
    estimate, run = ("estimate", root, *POSIT), ("run", recipe, "--out", root, "-q")
    codes, errs = at_once([run, estimate], "estimate", number, SHORT * duration, record_property)
    assert all(not err or f"{root} is being written by" in err for err in errs)
    assert_sound(root, before)
    made = [path.name for path in (root / "estimates").iterdir()]
    assert len([name for name in made if name.startswith("posit-truth")]) == (0 if codes[1] else 3)
    assert len([name for name in made if not name.startswith("posit-truth")]) == (0 if codes[0] else 15)
    assert command(*run) == 0
    for folder in (root, alone):
        assert command("estimate", folder, *POSIT) == 0
        assert command("score", folder, "-q") == 0
    assert content(root) == content(alone)
