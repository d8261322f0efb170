"""The memory of the nights: nothing is lost, nothing damaged is believed."""

import datetime
import itertools
import multiprocessing
import os
import signal
import time

import numpy as np
import pytest

from datasets.errors import UserError
from pipelines.nightly.history import FINDINGS, RUNS, History, new_run_id
from pipelines.nightly.judgement import judge
from pipelines.nightly.record import Exit, Night, Outcome, State
from tests.pipelines.nightly import simulated

START = datetime.datetime(2026, 5, 4, 3, 2, 1, tzinfo=datetime.UTC)
FAILED = Outcome("accuracy", State.FAILED, "corner_x is 0.002 px off", Exit.WORSE)


PASSED = Outcome("ran", State.PASSED, "all stages ran")
MORE_DELAYS_S = [pytest.param(i / 100, marks=pytest.mark.slow) for i in range(1, 41)]
CONTEXT = multiprocessing.get_context("spawn")  # Arrow's threads do not survive a fork


def _night(run_id):
    facts, data = (("commit", "abc"), ("numpy", "2.4.0")), (("pinned", "0" * 64),)
    return Night(run_id, START, "nightly", "first", facts, data, (PASSED, FAILED))


def _append(root, run_id, seed=0):
    old, new = (simulated.night(6, np.random.default_rng(seed + i)) for i in range(2))
    findings = judge(old, new, 0.01, paired=True).findings
    History(root).append(_night(run_id), {"pinned": findings}, 0.01, {"pinned old": old, "pinned new": new})


def test_what_was_appended_is_read_back(tmp_path):
    run_id = new_run_id(START)
    _append(tmp_path, run_id)
    history = History(tmp_path)
    (run,) = history.runs().to_pylist()
    assert (run["run_id"], run["exit"], run["sentence"]) == (run_id, 1, "accuracy: corner_x is 0.002 px off")
    assert run["started"] == START
    assert [gate["state"] for gate in run["gates"]] == ["passed", "failed"]
    findings = history.findings([run_id])
    assert len(findings) == 80
    assert findings.schema.equals(FINDINGS)
    names = {entry["name"]: entry["value"] for entry in run["measures"]}
    assert history.measures(names["pinned old"]).equals(simulated.night(6, np.random.default_rng(0)))


def test_no_history_is_an_empty_one(tmp_path):
    assert History(tmp_path / "none").runs().schema.equals(RUNS)
    assert History(tmp_path / "none").runs().num_rows == 0


def test_a_night_without_a_change_adds_no_measures(tmp_path):
    for _ in range(2):
        _append(tmp_path, new_run_id(START))
    assert len(list((tmp_path / "measures").iterdir())) == 2
    assert len(History(tmp_path).run_ids()) == 2


def test_runs_sort_by_time():
    later = START + datetime.timedelta(seconds=1)
    assert new_run_id(START) < new_run_id(later)
    assert new_run_id(START) != new_run_id(START)


@pytest.mark.parametrize(
    ("kind", "damage"),
    [
        *itertools.product(("runs", "findings", "measures"), ("cut", "other")),
        ("findings", "gone"),
        ("measures", "gone"),
    ],
)
def test_a_damaged_file_is_a_sentence(tmp_path, kind, damage):
    _append(tmp_path, new_run_id(START))
    history = History(tmp_path)
    ids = history.run_ids()
    path, *others = sorted((tmp_path / kind).iterdir())
    if damage == "cut":
        path.write_bytes(path.read_bytes()[:-10])
    elif damage == "gone":
        path.unlink()
    else:
        source = others[0] if others else next((tmp_path / "measures").iterdir())
        path.write_bytes(source.read_bytes())
    read = {
        "runs": history.runs,
        "findings": lambda: history.findings(ids),
        "measures": lambda: history.measures(path.stem),
    }
    with pytest.raises(UserError, match=path.name):
        read[kind]()


def test_two_appends_at_once_both_stand(tmp_path):
    ids = [new_run_id(START) for _ in range(2)]
    processes = [CONTEXT.Process(target=_append, args=(tmp_path, run_id)) for run_id in ids]
    for process in processes:
        process.start()
    for process in processes:
        process.join(60)
    assert [process.exitcode for process in processes] == [0] * 2
    assert History(tmp_path).run_ids() == sorted(ids)
    assert History(tmp_path).runs().num_rows == 2


def _append_many(root, ids):
    for seed, run_id in enumerate(ids):
        _append(root, run_id, seed)


@pytest.mark.parametrize(
    "delay_s", [0.03, *(pytest.param(delay_s, marks=pytest.mark.full) for delay_s in (0.0, 0.1)), *MORE_DELAYS_S]
)
def test_a_killed_append_loses_nothing(tmp_path, delay_s):
    """Whatever was there when the process was killed is whole, and the next append sweeps what it left."""
    ids = [f"{i:03d}" for i in range(500)]
    process = CONTEXT.Process(target=_append_many, args=(tmp_path, ids))
    process.start()
    history = History(tmp_path)
    while not history.run_ids():
        time.sleep(0.002)
    time.sleep(delay_s)
    os.kill(process.pid, signal.SIGKILL)
    process.join(60)
    done = history.run_ids()
    assert done == ids[: len(done)]
    assert history.runs().num_rows == len(done)
    assert history.findings(done).num_rows == 80 * len(done)
    _append(tmp_path, "999")
    assert not list(tmp_path.rglob(".tmp-*"))
