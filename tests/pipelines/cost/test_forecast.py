"""Costs before anything is made: they follow the figures, and need neither a plan nor much memory."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from pathlib import Path

import pytest

from datasets.recipe.model import load_recipe, parse_recipe, recipe_names
from datasets.store.kept_masters import Kept
from pipelines.cost import figures as measured
from pipelines.cost.choice import forecast_of
from pipelines.cost.figures import IMAGES, TABLES_OF_RUN, Figures
from pipelines.cost.forecast import forecast, lasting, sized
from pipelines.cost.reference import SHARD_FILES, reference_figures
from pipelines.stages.settings import run_settings
from tests.conftest import TINY
from tests.wrong_input import assert_one_sentence

FIGURES = Figures(
    {"generate": 2.0, "detect": 1.0, "estimate": 0.5, "score": 0.5},
    {"frames": 700.0, "keypoints": 100.0, "masters": 4000.0, "truth": 0.0},
    shard_bytes=1000.0,
    shard_files=13,
    worker_mb=300.0,
    source="a test",
)
RECIPE = parse_recipe(TINY.replace("shard_frames = 1\n", ""), "test")


@pytest.fixture
def own_cache(tmp_path, monkeypatch):
    """An empty folder for figures."""
    monkeypatch.setattr(measured, "folders", lambda: [tmp_path / "cache"])
    return tmp_path / "cache"


def test_costs_grow_with_frames_and_are_shared_by_workers():
    found = forecast(RECIPE, FIGURES, frames=10**9, workers=100, kept=Kept.FILES)
    assert (found.shards, found.shard_frames) == (10**6, 1000)
    assert found.seconds == pytest.approx(4.0 * 10**9 / 100)
    assert found.total_bytes == pytest.approx(4800.0 * 10**9 + 1000.0 * 10**6)
    assert found.files == 13 * 10**6 + 10**9
    lean = forecast(RECIPE, FIGURES, frames=10**9, workers=100, kept=Kept.NOT)
    assert lean.total_bytes == pytest.approx(800.0 * 10**9 + 1000.0 * 10**6)
    assert lean.files == 13 * 10**6
    packed = forecast(RECIPE, FIGURES, frames=10**9, workers=100, kept=Kept.ARCHIVES)
    assert packed.files == 14 * 10**6
    assert packed.total_bytes == pytest.approx(found.total_bytes + 96.0 * 10**9)
    few = forecast(RECIPE, FIGURES, frames=12, workers=1, kept=Kept.FILES)
    assert (few.shards, few.shard_frames) == (2, 10)
    # A shard of a thousand times 800 bytes is held four times.
    assert found.worker_mb - FIGURES.worker_mb == pytest.approx(4.0 * 1000 * 800 / 2**20)


@pytest.mark.parametrize("name", recipe_names())
def test_every_recipe_has_figures_of_another_machine(name):
    recipe = load_recipe(name)[0]
    found = reference_figures(recipe)
    assert set(found.frame_bytes) == {*TABLES_OF_RUN, *IMAGES}
    assert min(found.seconds.values()) > 0.0
    # frames, keypoints and detections, and of each kind of estimates these and their scores
    assert found.shard_files == 3 + 2 * len(run_settings(recipe.target))
    assert found.shard_files in SHARD_FILES.values()


def test_figures_of_this_machine_come_first_and_are_those_of_such_frames(own_cache):
    def source(recipe):
        return forecast_of(recipe, frames=10, workers=1, kept=Kept.FILES).source

    assert "another machine" in source(RECIPE)
    path = measured.keep_figures(RECIPE, FIGURES)
    assert path.parent == own_cache
    assert measured.read_figures(RECIPE) == FIGURES
    longer = parse_recipe(TINY.replace("stop = 90", "stop = 9000").replace("seed = 5", "seed = 6"), "test")
    assert source(longer) == "a test"
    larger = parse_recipe(TINY.replace("width = 400", "width = 500"), "test")
    assert "another machine" in source(larger)
    for wrong in ("{", "[]", "{}", json.dumps(dataclasses.asdict(FIGURES) | {"seconds": {"generate": "x"}})):
        path.write_text(wrong)
        assert "another machine" in source(RECIPE)


def test_numbers_are_told_as_people_read_them():
    assert [sized(value) for value in (12, 4_800, 46e6, 9.4e9, 526e12, 4e18)] == [
        "12 bytes", "4.8 kB", "46 MB", "9.4 GB", "526 TB", "4000 PB",
    ]  # fmt: skip
    assert [lasting(value) for value in (0.07, 90, 7200, 86400 * 30, 3.2e8)] == [
        "0.07 seconds", "1.5 minutes", "2 hours", "30 days", "10 years",
    ]  # fmt: skip


def test_the_command_says_it_for_a_thousand_million_frames(cli, own_cache):
    done = cli("plan", "charuco", "--frames", "1e9", "--workers", 64, "--json")
    assert (done.code, done.err) == (0, "")
    found = json.loads(done.out)
    assert (found["frames"], found["workers"], found["shard_frames"]) == (10**9, 64, 6)
    assert sum(found["bytes"].values()) == pytest.approx(found["total_bytes"], rel=1e-9)
    shown = cli("plan", "charuco", "--frames", "1e9").out
    assert "charuco: 1000000000 frames in 166666667 shards of 6" in shown
    assert "shard_frames = 1000 in the recipe would make 1000000 shards" in shown
    assert "`plan charuco --measure` takes this one's" in shown
    assert "24 frames in 4 shards of 6" in cli("plan", "charuco").out
    refused = cli("plan", "charuco", "--workers", 0)
    assert_one_sentence(refused.code, refused.err, "give --workers from 1 to 1000000")


@pytest.mark.parametrize("frames", ["0", "-5", "1.5", "1e13", "nan", "inf", "many", "1e999"])
def test_a_number_of_frames_that_is_none_is_refused(frames, cli):
    done = cli("plan", "demo", "--frames", frames)
    assert done.code == 2
    assert_one_sentence(done.code, done.err, "give a whole number from 1 to 1e+12")


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="the system does not tell the peak of memory")
def test_the_command_stays_below_200_mb():
    code = (
        "import re, sys\n"
        "from pathlib import Path\n"
        "from pipelines.cli import main\n"
        "sys.argv = ['pipelines', 'plan', 'paper', '--frames', '1e9', '--json']\n"
        "assert main() == 0\n"
        "print(re.search(r'VmHWM:\\s+(\\d+) kB', Path('/proc/self/status').read_text())[1], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert int(done.stderr) < 200_000


@pytest.mark.full
@pytest.mark.usefixtures("no_report")
def test_what_is_measured_is_what_a_run_takes(cli, own_cache, tmp_path):
    recipe = tmp_path / "tiny.toml"
    recipe.write_text(TINY.replace("step = 90", "step = 3").replace("shard_frames = 1", "shard_frames = 31"))
    measured = json.loads(cli("plan", recipe, "--measure", "--json").out)
    assert "8 frames measured on this machine" in measured["figures"]
    assert cli("run", recipe, "--out", tmp_path / "out", "-q").code == 0
    for folder in ("frames", "estimates", "masters"):
        held = sum(path.stat().st_size for path in (tmp_path / "out" / folder).iterdir())
        # Footers are counted apart, 5 kB for each of five files at most; no two frames are equally large.
        assert held - 25_000 < 1.2 * measured["bytes"][folder]
        assert measured["bytes"][folder] < 1.2 * held
    files = sum(path.is_file() for path in (tmp_path / "out").rglob("*.parquet"))
    assert files + 31 == measured["files"]
