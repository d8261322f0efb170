"""Tables on the terminal: they fit it, and `--json` gives the same to machines."""

import json
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from datasets.recipe.model import recipe_names
from pipelines.bench.table import Comparison, Figure
from pipelines.cli import USER_ERROR
from pipelines.commands import tables
from pipelines.commands.tables import Column, Footnotes, table_lines

ROOT = Path(__file__).resolve().parents[3]
WIDTH = 80  # what is assumed where there is no terminal
RAYS, LOOP = "64 primary rays for each pixel", "PoseLib p3p, in a loop"
TIMES = [
    Comparison("render", "kannala_brandt: render, 64 samples", 12.34567, RAYS, 1e5, 1e4, 2.0),
    Comparison("render", "one render of each camera and a name that is long", 1e-5, RAYS, 3, 2, 2),
    Comparison("solver, a pose of four points", "solve best, batch of 100000", 0.001, LOOP, 1, 1, 1),
]
SIZES = "480000 / 1920000 / 7680000"
FIGURES = [
    Figure("memory", "resident after 2000 frames", "1234 MB", "", "+5.0 MB"),
    Figure("blender", "equisolid: corners, ours", "0.0029 px RMS", "corners, Cycles 5.0.1, 64 rays", "0.0050 px RMS"),
    Figure("growth", f"perspective: detection at {SIZES} pixels", "12 / 40 / 160 ms", "", "exponent 1.0"),
]


@pytest.fixture(autouse=True)
def narrow(monkeypatch):
    """A terminal of 80 columns."""
    monkeypatch.setenv("COLUMNS", str(WIDTH))


@pytest.fixture
def measured(monkeypatch):
    """`bench` without measuring."""
    monkeypatch.setattr("pipelines.bench.command.measured", lambda *_: [*TIMES, *FIGURES])


def assert_fits(text):
    assert text
    assert [line for line in text.splitlines() if len(line) > WIDTH] == []


COMMANDS = [("recipes",), ("describe",), *(("describe", name) for name in recipe_names()), ("doctor",), ("bench",)]


@pytest.mark.parametrize("words", COMMANDS, ids=" ".join)
def test_tables_fit_and_are_json_on_demand(words, cli, measured):
    shown = cli(*words)
    assert (shown.code, shown.err) == (0, "")
    assert_fits(shown.out)
    told = cli(*words, "--json")
    assert (told.code, told.err) == (0, "")
    assert json.loads(told.out)


def test_json_has_what_the_tables_have(cli, measured):
    names = [row["name"] for row in json.loads(cli("recipes", "--json").out)]
    assert names == list(recipe_names())
    described = json.loads(cli("describe", "--json").out)
    assert described["regimes"]["sensor.gamma"]["clean"] == 1.0
    assert {"key": "seed", "default": "0", "meaning": "seed of everything random; 0 is a seed"} in described["keys"]
    values = {row["key"]: row["value"] for row in json.loads(cli("describe", "smoke", "--json").out)["keys"]}
    assert values["name"] == '"smoke"'
    assert all(check["fine"] for check in json.loads(cli("doctor", "--json").out))
    speed = json.loads(cli("bench", "--json").out)
    assert [row["ratio"] for row in speed["times"]] == [1e4, 2, 1]
    assert speed["figures"][0]["value"] == "+5.0 MB"
    assert "numpy" in speed["machine"]


def test_verify_tells_the_hash_and_every_problem(root, cli, content):
    assert json.loads(cli("verify", root, "--json").out) == {"content": content(root), "problems": []}
    assert_fits(cli("verify", root).out)
    for path in (root / "keypoints").iterdir():
        path.unlink()
    told = cli("verify", root, "--json")
    assert told.code == USER_ERROR
    assert told.err.startswith("error: ")
    assert len(json.loads(told.out)["problems"]) == 2


def test_what_doctor_misses_is_in_both_forms(monkeypatch, cli):
    monkeypatch.setattr("pipelines.doctor.version_of", lambda name: None if name == "mitsuba" else "1")
    shown, told = cli("doctor"), cli("doctor", "--json")
    assert shown.code == told.code == USER_ERROR
    assert "MISSING  mitsuba" in shown.out
    missing = [check for check in json.loads(told.out) if not check["fine"]]
    assert missing == [{"name": "mitsuba", "fine": False, "found": "not installed; run `make setup`"}]


def test_the_table_of_the_benchmark_is_grouped_and_has_each_footnote_once(cli, measured):
    text = cli("bench").out
    assert text.count("render\n") == 1
    assert text.count("64 primary rays") == 1
    assert "[1] 64 primary rays for each pixel" in text
    (line,) = (line for line in text.splitlines() if line.startswith("  kannala_brandt"))
    assert line.split()[-5:] == ["12.3", "100000", "[1]", "10000", "2"]


def test_numbers_stand_on_the_right_and_long_cells_have_a_footnote():
    notes, meaning = Footnotes(), "how it is done: " + "with many words " * 20
    lines = table_lines((Column("name"), Column("n", number=True)), [("a", "1"), (meaning, "1000")], 40, notes)
    assert all(len(line) <= 40 for line in lines)
    assert lines[1].split() == ["a", "1"]
    assert len(lines[1]) == len(lines[0])  # the numbers' right edge
    assert lines[2].startswith("how it is done [1]")
    assert len(lines) == 3
    assert " ".join(notes.lines(40)).replace("    ", "") == " ".join(textwrap.wrap("[1] " + meaning, 400))


def test_a_cell_of_two_lines_is_wrapped_and_keeps_its_indent():
    lines = table_lines((Column("name"), Column("n", number=True)), [("  " + "word " * 12, "1")], 40, Footnotes())
    assert len(lines) == 3
    assert all(line.startswith("  word") for line in lines[1:])


def test_a_pipe_is_eighty_columns_wide():
    environment = {name: value for name, value in os.environ.items() if name not in ("COLUMNS", "LINES")}
    words = [sys.executable, "-m", "pipelines", "recipes"]
    done = subprocess.run(words, env=environment, cwd=ROOT, capture_output=True, text=True, check=True)
    assert_fits(done.stdout)
    assert max(map(len, done.stdout.splitlines())) > WIDTH - 10


def test_a_terminal_without_columns_has_some(monkeypatch):
    monkeypatch.setenv("COLUMNS", "5")
    assert tables.terminal_width() == tables.LEAST_WIDTH
