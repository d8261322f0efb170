"""Nights from end to end on six small frames: every exit code but 2 by what causes it, and what a killed night leaves.

All share one history, since pictures and a baseline take seconds to make. The baseline's code is the checkout, so that
a fault planted in this process is the candidate's alone.
"""

import dataclasses
import datetime
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow.parquet as pq
import pytest

from datasets.store.dataset import open_dataset
from datasets.store.images import decode_png
from pipelines.nightly import baselines
from pipelines.nightly.acceptance import accept_baseline
from pipelines.nightly.accepted import Waiver
from pipelines.nightly.baselines import FILE_NAME
from pipelines.nightly.history import History
from pipelines.nightly.other_code import ROOT
from pipelines.stages import detect
from tests.conftest import command

SEED = 7
RUN = ("nightly", "run", "nightly-smoke", "--regime", "typical", "--seed", SEED, "--quiet")
QUICK = (*RUN, "--without", "fresh", "--without", "speed")
SLICE = "typical/orthogonal/edge-fit"


@pytest.fixture(scope="module")
def nights(tmp_path_factory):
    """A history whose first night is the baseline."""
    root = tmp_path_factory.mktemp("nights")
    assert command(*RUN, "--history", root) == 3  # no baseline yet
    first = accept_baseline(root, "latest", "the first", "somebody")
    (entry,) = baselines.load(root / FILE_NAME).baselines
    (root / FILE_NAME).unlink()
    baselines.accept(root / FILE_NAME, dataclasses.replace(entry, checkout=ROOT))
    assert History(root).run_ids() == [first]
    return root


@pytest.fixture
def night(nights, cli):
    """Run a night; its `Outcome` on the terminal, and its row in the history."""

    def run(*words):
        before = History(nights).run_ids()
        done = cli(*words, "--history", nights)
        (new,) = set(History(nights).run_ids()) - set(before)
        row = History(nights).run(new)
        assert done.code == row["exit"], done.err
        return done, row

    return run


def _states(row):
    return {item["gate"]: item["state"] for item in row["gates"]}


def _sentence(row, gate):
    (found,) = [item["sentence"] for item in row["gates"] if item["gate"] == gate]
    return found


def _plant(monkeypatch, size_px):
    """The candidate's corners, and not the circle behind them, lie too far to the right."""
    real = detect.detect_points

    def moved(*words):
        found = real(*words)
        step = np.zeros_like(found.points_px)
        step[:-1, 0] = size_px
        return dataclasses.replace(found, points_px=found.points_px + step)

    monkeypatch.setattr(detect, "detect_points", moved)


def test_the_same_code_is_fine_in_every_gate(night, nights):
    """Both suites with the baseline's code in a process of its own; exit code 0."""
    done, row = night(*RUN, "--without", "speed")
    states = _states(row)
    assert {gate for gate, state in states.items() if state == "not run"} == {"tail", "speed"}  # six frames
    assert {state for gate, state in states.items() if gate not in ("tail", "speed")} == {"passed"}
    assert _sentence(row, "accuracy") == "every number of every frame is the same as the baseline's"
    digests = {item["name"]: item["value"] for item in row["measures"]}
    assert digests["fresh old"] == digests["fresh new"]
    assert "exit 0, fine" in done.out
    assert (nights / "report.html").is_file()
    assert json.loads((nights / "metrics.json").read_text())["exit"] == 0


@pytest.mark.full
def test_corners_that_are_off_by_two_thousandths_of_a_pixel_are_worse(night, monkeypatch, nights, cli):
    """Exit code 1, on pinned pictures and on two looks at fresh ones; `explain` names frames."""
    _plant(monkeypatch, 0.002)
    _, row = night(*RUN, "--without", "speed")
    assert row["exit"] == 1
    states = _states(row)
    assert (states["accuracy"], states["fresh"], states["data"]) == ("failed", "failed", "passed")
    assert row["sentence"].startswith("accuracy: corner_")
    found = [item for item in History(nights).findings([row["run_id"]]).to_pylist() if item["metric"] == "corner_x"]
    assert {item["suite"] for item in found} == {"pinned", "fresh", "confirming"}
    assert {item["verdict"] for item in found} == {"worse"}
    assert all(item["effect"] == pytest.approx(0.002, abs=1e-9) for item in found)  # rounding of sums of pixels
    _shows_the_worst_frames(nights, row, cli)
    explained = cli("nightly", "explain", SLICE, "--history", nights, "--json")
    assert explained.code == 0
    assert len({item["frame_id"] for item in json.loads(explained.out)["moved"]}) > 1


def _shows_the_worst_frames(nights, row, cli):
    """All twelve of both suites, with both sides' corners; the command beside one makes the same picture."""
    page = (nights / "report.html").read_text()
    commands = re.findall(r'Make it again: <code class="command">python -m pipelines (.+?)</code>', page)
    assert len(commands) == 12
    assert page.count("<b>baseline</b> 55 of 55 points") == page.count("<b>candidate</b> 55 of 55 points") == 12
    for suite in ("pinned", "fresh"):
        words = shlex.split(next(line for line in commands if f" {suite}-typical " in line))
        out = nights / "frame.png"
        done = cli(*words[:-1], out)
        assert done.code == 0
        assert "54 of 54 corners, mean error " in done.out
    pictures = open_dataset(nights / "pictures" / "pinned-typical")
    (stored,) = [item for item in pictures.read("frames").to_pylist() if item["frame_id"] == 2]
    assert cli("nightly", "frame", "pinned-typical", 2, "--history", nights, "--out", out).code == 0
    np.testing.assert_array_equal(decode_png(out.read_bytes()), decode_png(stored["image"]["bytes"]))
    for words, told in ((("fresh-typcal", 0), "did you mean"), (("fresh-typical", 6), "from 0 to 5")):
        done = cli("nightly", "frame", *words, "--history", nights, "--out", out)
        assert (done.code, told in done.err) == (2, True)


@pytest.mark.full
def test_a_waiver_counts_until_its_day_has_passed(night, monkeypatch, nights):
    _plant(monkeypatch, 0.002)
    _, row = night(*QUICK)
    known = (nights / FILE_NAME).read_bytes()
    worse = [item for item in History(nights).findings([row["run_id"]]).to_pylist() if item["verdict"] == "worse"]
    today = datetime.date.today()
    try:
        for until, state in ((today, "waived"), (today - datetime.timedelta(1), "failed")):
            (nights / FILE_NAME).write_bytes(known)
            for item in worse:
                names = {"slice": item["slice"], "metric": item["metric"], "run": row["run_id"], "until": until}
                baselines.accept(nights / FILE_NAME, Waiver(gate="accuracy", reason="known", by="somebody", **names))
            done, judged = night(*QUICK)
            assert _states(judged)["accuracy"] == state
            ended = f"ended on {until}, and the gate judges it again (known)"
            assert (ended in done.err) is (state == "failed")
            assert any(ended in item["value"] for item in judged["facts"]) is (state == "failed")
    finally:
        (nights / FILE_NAME).write_bytes(known)


def test_a_candidate_that_breaks_could_not_run(night, monkeypatch):
    """Exit code 4 and not Python's own 1, which means worse."""

    def broken(*_):
        raise ZeroDivisionError("a defect")

    monkeypatch.setattr(detect, "detect_points", broken)
    done, row = night(*QUICK)
    assert row["exit"] == 4
    states = [item for item in row["gates"] if item["gate"] == "ran"]
    assert [(item["state"], item["sentence"]) for item in states] == [
        ("failed", "could not run: ZeroDivisionError: a defect")
    ]
    assert "in broken" in done.err


@pytest.mark.full
def test_a_baseline_that_no_longer_imports_could_not_run(night, nights):
    """Exit code 4 in the gates that need its code; the others are judged."""
    known = (nights / FILE_NAME).read_text()
    broken = nights / "broken"
    shutil.copytree(next((nights / "code").iterdir()), broken)
    (broken / "eposit" / "__init__.py").write_text("raise ImportError('no such library')\n")
    try:
        (nights / FILE_NAME).write_text(known.replace(str(ROOT), str(broken)))
        _, row = night(*RUN)
    finally:
        (nights / FILE_NAME).write_text(known)
    assert row["exit"] == 4
    states = _states(row)
    assert [states[gate] for gate in ("accuracy", "fresh", "failures", "speed")] == [
        "passed", "failed", "passed", "failed",
    ]  # fmt: skip
    assert "no such library" in _sentence(row, "fresh")
    assert "no such library" in _sentence(row, "speed")
    assert row["sentence"].startswith("fresh: could not run: code in ")


def test_a_baseline_whose_folder_is_gone_could_not_run(night, nights):
    known = (nights / FILE_NAME).read_text()
    try:
        (nights / FILE_NAME).write_text(known.replace(str(ROOT), str(nights / "nosuch")))
        _, row = night(*QUICK)
    finally:
        (nights / FILE_NAME).write_text(known)
    assert row["exit"] == 4
    assert "where no folder is" in _sentence(row, "baseline")


def test_other_pinned_pictures_give_no_verdict(night, nights):
    """Exit code 3."""
    pictures = open_dataset(nights / "pictures" / "pinned-typical")
    path, *_ = pictures.shards("frames")
    known = path.read_bytes()
    table = pictures.read_shard(path)
    images = table["image"].to_pylist()
    swapped = table.set_column(table.schema.get_field_index("image"), table.schema.field("image"), [images[::-1]])
    try:
        pictures.write_shard(path, swapped)
        _, row = night(*QUICK)
    finally:
        path.write_bytes(known)
    assert row["exit"] == 3
    assert (_states(row)["data"], _states(row)["accuracy"]) == ("failed", "not run")
    assert row["sentence"].startswith("data: the pinned pictures are not the baseline's")


def test_another_recipe_has_no_baseline(nights, cli, tmp_path):
    text = (ROOT / "datasets" / "recipes" / "nightly-smoke.toml").read_text()
    other = tmp_path / "other.toml"
    other.write_text(text.replace('"nightly-smoke"', '"other"'))
    (tmp_path / "nights").mkdir()
    shutil.copy(nights / FILE_NAME, tmp_path / "nights")
    done = cli("nightly", "run", other, *QUICK[3:], "--history", tmp_path / "nights")
    assert done.code == 3
    assert f"there is no baseline of recipe {other} yet" in " ".join(done.out.split())


WRONG = {
    "no history": (("nightly", "report"), "holds no nights"),
    "no run": (("nightly", "accept", "nosuch", "--reason", "x"), "has no run 'nosuch'"),
    "unknown gate": ((*QUICK, "--without", "data"), "--without data: choose fresh or speed"),
    "unknown recipe": (("nightly", "run", "nosuch"), "nosuch"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_use_is_one_sentence(name, nights, tmp_path, cli):
    words, told = WRONG[name]
    done = cli(*words, "--history", tmp_path / "none" if name == "no history" else nights)
    assert done.code == 2
    assert told in done.err
    assert done.err.startswith("error: ")
    assert done.err.count("\n") == 1


def test_a_damaged_run_is_told_before_anything_is_rendered(nights, tmp_path, cli):
    shutil.copytree(nights / "runs", tmp_path / "runs")
    path = sorted((tmp_path / "runs").iterdir())[0]
    path.write_bytes(path.read_bytes()[:-10])
    done = cli(*QUICK, "--history", tmp_path)
    assert done.code == 2
    assert f"{path} is not a readable Parquet file" in done.err
    assert not (tmp_path / "pictures").exists()


def _content(root):
    return {
        path.relative_to(root): path.read_bytes() for kind in ("runs", "findings", "measures")
        for path in (root / kind).iterdir()
    }  # fmt: skip


@pytest.mark.full
def test_a_night_that_is_killed_leaves_the_history_as_it_was(night, nights):
    before = _content(nights)
    words = [sys.executable, "-m", "pipelines", *map(str, QUICK), "--history", str(nights)]
    with subprocess.Popen(words, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while not list(nights.glob(".work-*/pinned-typical/recipe.toml")) and process.poll() is None:
            time.sleep(0.02)
        os.kill(process.pid, signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert list(nights.glob(".work-*")) != []
    assert _content(nights) == before
    _, row = night(*QUICK)
    assert row["exit"] == 0
    assert list(nights.glob(".work-*")) == []
    after = _content(nights)
    assert {name: after[name] for name in before} == before
    assert {path.parent.name for path in after.keys() - before.keys()} == {"runs", "findings"}  # measures are known


def test_every_file_of_the_history_has_its_columns(nights):
    for path in (nights / "runs").iterdir():
        assert pq.read_schema(path).names[0] == "run_id"
