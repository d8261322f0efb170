"""However a command ends, it says so in one sentence: signals at any moment, a full disk, what nobody expected."""

from __future__ import annotations

import os
import random
import resource
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from pipelines.cli import guarded
from pipelines.endings import UNEXPECTED, UNFINISHED, UNREAD
from pipelines.stages import generate
from tests.signals import heed_signals
from tests.wrong_input import first, left_behind

ROOT = Path(__file__).parents[2]
PATIENCE_S = 120.0
MOMENTS = 20  # of each signal


def started(*words, **options):
    return subprocess.Popen(
        [sys.executable, "-m", "pipelines", *map(str, words)],
        cwd=ROOT, stderr=subprocess.PIPE, text=True,
        **({"stdout": subprocess.DEVNULL, "preexec_fn": heed_signals} | options),
    )  # fmt: skip


@pytest.mark.parametrize("words", [("recipes",), ("recipes", "--json"), ("run", "--help")])
def test_a_reader_that_has_gone_is_no_result(words):
    unread, output = os.pipe()
    os.close(unread)
    process = started(*words, stdout=output)
    os.close(output)
    assert (process.communicate(timeout=PATIENCE_S)[1], process.returncode) == ("", UNREAD)


def limited():
    """No file of this process may be larger than 60 kB: as on a full disk, writing stops in the middle."""
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, 60_000))


def listens(process):
    """Wait until the process has its handlers: the kernel tells which signals are caught."""
    end = time.monotonic() + PATIENCE_S
    wanted = 1 << signal.SIGTERM - 1
    while time.monotonic() < end:
        lines = Path(f"/proc/{process.pid}/status").read_text().splitlines()
        caught = next(int(line.split()[1], 16) for line in lines if line.startswith("SigCgt"))
        if caught & wanted:
            return
        time.sleep(0.002)


def assert_stopped(process, number):
    err = process.communicate(timeout=PATIENCE_S)[1]
    assert process.returncode == 128 + number, err
    lines = err.strip().splitlines()
    assert lines[-1].startswith(
        f"stopped by {signal.Signals(number).name}; to go on, run again: python -m pipelines run"
    )
    assert "Traceback" not in err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_among_the_imports_is_one_sentence(number, tmp_path):
    process = started("run", "smoke", "--out", tmp_path / "out", "-q")
    listens(process)
    process.send_signal(number)
    assert_stopped(process, number)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
@pytest.mark.parametrize("moment", range(MOMENTS))
def test_a_signal_at_any_moment_is_one_sentence_and_loses_nothing(number, moment, tiny, tmp_path, cli, content):
    recipe, root = tmp_path / "tiny.toml", tmp_path / "out"
    recipe.write_text(tiny[0])
    process = started("run", recipe, "--out", root, "-q", "--workers", 1 + moment % 2, start_new_session=True)
    listens(process)
    time.sleep(random.Random(f"{number} {moment}").uniform(0.0, 12.0))
    if process.poll() is None:
        os.killpg(process.pid, number)  # as a terminal sends it
        assert_stopped(process, number)
    assert cli("run", recipe, "--out", root, "-q").code == 0
    assert content(root) == content(tiny[1])
    assert left_behind(root) == []


IN_A_DESTRUCTOR = """
import os, signal, sys, time
from pipelines.endings import Stopped, listen, say_stopped

class Dying:
    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        for _ in range(1000):
            pass

listen()
try:
    Dying()
    time.sleep(60)
except Stopped as stop:
    print("unwound")
    sys.exit(say_stopped(stop.number))
"""


def test_a_signal_in_a_destructor_which_can_raise_nothing_is_one_sentence(tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", IN_A_DESTRUCTOR], cwd=ROOT, capture_output=True, text=True, timeout=PATIENCE_S
    )
    assert (done.returncode, done.stdout) == (128 + signal.SIGTERM, "unwound\n")
    assert done.stderr == "\nstopped by SIGTERM; to go on, run again: python -m pipelines\n"


def test_a_full_disk_is_one_sentence_and_the_run_goes_on_from_there(tiny, tmp_path, cli, content):
    recipe, root = tmp_path / "tiny.toml", tmp_path / "out"
    recipe.write_text(tiny[0])
    process = started("generate", recipe, "--out", root, "-q", preexec_fn=limited)  # a master has 100 kB
    err = process.communicate(timeout=PATIENCE_S)[1]
    assert process.returncode == 2
    assert err.startswith("error: cannot write ")
    assert err.count("\n") == 1
    assert list(root.rglob(".tmp-*")) == []
    assert cli("generate", recipe, "--out", root, "-q").code == 0
    other = tmp_path / "other"
    assert cli("generate", recipe, "--out", other, "-q", "--reuse", tiny[1]).code == 0
    assert content(root) == content(other)


def test_what_nobody_expected_is_one_sentence_with_its_traceback_in_a_file(capfd, monkeypatch, tmp_path):
    def command():
        raise ZeroDivisionError("as nobody\nexpected")

    with monkeypatch.context() as patch:
        patch.setattr("tempfile.tempdir", str(tmp_path))
        assert guarded(command) == UNEXPECTED
    err = capfd.readouterr().err
    assert err.startswith("error: something that nobody expected (ZeroDivisionError: as nobody expected); ")
    assert err.count("\n") == 1
    (log,) = tmp_path.iterdir()
    assert str(log) in err
    assert "in command" in log.read_text()
    with monkeypatch.context() as patch:
        patch.setattr("tempfile.tempdir", str(tmp_path / "no"))
        assert guarded(command) == UNEXPECTED
    assert "could not be kept (No such file or directory): test_endings.py, line" in capfd.readouterr().err


@pytest.mark.usefixtures("no_report")
def test_a_shard_that_cannot_be_made_is_left_out_noted_and_tried_again(root, tiny, cli, monkeypatch, content):
    """Frame 1 fails in every try: the other one goes through all stages; the same command makes the rest later."""
    before = content(root)
    real = generate._rendered

    def render(recipe, frame, folder=None):
        if frame.frame_id == 1:
            raise ZeroDivisionError("no light")
        return real(recipe, frame, folder)

    for folder in ("frames", "keypoints", "detections", "estimates", "scores", "masters"):
        for path in (root / folder).iterdir():
            path.unlink()
    with monkeypatch.context() as patch:
        patch.setattr(generate, "_rendered", render)
        done = cli("run", root / "recipe.toml", "--out", root, "-q")
    assert done.code == UNFINISHED
    assert (
        "1 shard could not be made, each tried twice (generate, frames 1 to 1: ZeroDivisionError: no light; "
        in done.err
    )
    assert "and this tries them again: python -m pipelines run " in done.err
    assert done.err.count("\n") == 1
    (note,) = (root / "quarantine" / "failed").iterdir()
    assert note.name == "generate-00001.txt"
    assert "in render" in note.read_text()
    assert first(root, "scores").name.endswith("-00000-of-00002.parquet")
    assert cli("run", root / "recipe.toml", "--out", root, "-q").code == 0
    for folder in ("estimates", "scores"):
        for path in (root / folder).iterdir():
            if not path.name.startswith("best-detected-exact-all"):
                path.unlink()
    assert cli("score", root, "-q").code == 0
    assert content(root) == before
