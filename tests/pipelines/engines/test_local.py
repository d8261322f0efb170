"""Engines: every task once, errors reach the caller, a task that fails twice is told, workers end with their parent."""

import contextlib
import functools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from datasets.errors import UserError
from pipelines.engines.local import LocalEngine
from tests.signals import heed_signals

ROOT = Path(__file__).parents[3]
PATIENCE_S = 60.0
SLEEPING = """
import sys, time
from pathlib import Path
from pipelines.engines.local import LocalEngine
from tests.pipelines.engines.test_local import sleeps

if __name__ == "__main__":
    list(LocalEngine(2).map(sleeps, [Path(sys.argv[1]) / name for name in "ab"]))
"""


def double(task):
    return 2 * task


def fails_at_two(task):
    if task == 2:
        raise UserError("two is wrong")


def crashes_at_two(task):
    if task == 2:
        raise ZeroDivisionError("two")
    return task


def dies_at_two(number, folder, task):
    """The first `number` times."""
    if task == 2 and len(list(folder.iterdir())) < number:
        (folder / str(os.getpid())).touch()
        os.kill(os.getpid(), signal.SIGSEGV)
    return task


def sleeps(path):
    path.with_name(str(os.getpid())).touch()
    time.sleep(PATIENCE_S)


@pytest.mark.parametrize("workers", [1, 2])
def test_every_task_is_done_once(workers):
    assert sorted(LocalEngine(workers).map(double, range(5))) == [(0, 0), (1, 2), (2, 4), (3, 6), (4, 8)]


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_in_a_task_reaches_the_caller(workers):
    with pytest.raises(UserError, match="two is wrong"):
        list(LocalEngine(workers).map(fails_at_two, range(5), failed=lambda *_: None))
    with pytest.raises(ZeroDivisionError):
        list(LocalEngine(workers).map(crashes_at_two, range(5)))


@pytest.mark.parametrize("workers", [1, 2])
def test_a_task_that_fails_twice_is_told_and_the_others_are_done(workers):
    told = []
    done = LocalEngine(workers).map(crashes_at_two, range(5), failed=lambda task, why: told.append((task, why)))
    assert sorted(done) == [(0, 0), (1, 1), (3, 3), (4, 4)]
    ((task, why),) = told
    assert (task, why.reason) == (2, "ZeroDivisionError: two")
    assert "crashes_at_two" in why.trace


@pytest.mark.parametrize(("times", "done"), [(1, [0, 1, 2, 3, 4]), (2, [0, 1, 3, 4])])
def test_a_worker_that_crashes_costs_one_more_try(times, done, tmp_path):
    told = []
    run_one = functools.partial(dies_at_two, times, tmp_path)
    results = LocalEngine(2).map(run_one, range(5), failed=lambda task, why: told.append((task, why.reason)))
    assert sorted(task for task, _ in results) == done
    assert [task for task, _ in told] == [2] * (times - 1)
    assert all("ended by SIGSEGV" in reason for _, reason in told)


def test_a_worker_that_is_lost_without_anyone_to_tell_is_a_sentence(tmp_path):
    with pytest.raises(UserError, match="a worker process was ended by SIGSEGV"):
        list(LocalEngine(2).map(functools.partial(dies_at_two, 2, tmp_path), range(5)))


@pytest.mark.parametrize("workers", [0, -1, 100000])
def test_workers_out_of_range(workers):
    with pytest.raises(UserError, match="--workers from 1"):
        LocalEngine(workers)


def alive(process):
    """Whether a process is there and has not ended."""
    with contextlib.suppress(OSError):
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


@pytest.mark.parametrize("name", ["SIGKILL", "SIGTERM", "SIGHUP", "SIGINT", "SIGQUIT"])
def test_workers_end_with_their_parent(name, tmp_path):
    script = tmp_path / "sleeping.py"
    script.write_text(SLEEPING)
    folder = tmp_path / "begun"
    folder.mkdir()
    paths = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
    process = subprocess.Popen(
        [sys.executable, script, folder],
        env=os.environ | {"PYTHONPATH": paths}, stderr=subprocess.DEVNULL, preexec_fn=heed_signals,
    )  # fmt: skip
    end = time.monotonic() + PATIENCE_S
    while len(list(folder.iterdir())) < 2 and process.poll() is None and time.monotonic() < end:
        time.sleep(0.02)
    workers = [int(path.name) for path in folder.iterdir()]
    assert len(workers) == 2
    process.send_signal(getattr(signal, name))
    process.wait(PATIENCE_S)
    end = time.monotonic() + 10.0  # the kernel needs none; a waiting thread elsewhere a moment
    while any(map(alive, workers)) and time.monotonic() < end:
        time.sleep(0.02)
    assert [worker for worker in workers if alive(worker)] == []
