"""Whatever a user's function does to its process is a status of one image; the others are solved."""

from __future__ import annotations

import contextlib
import errno
import os
import sys

import pytest

from datasets.errors import UserError
from pipelines.adapters import process
from pipelines.adapters.limits import DEFAULT, Limits
from pipelines.adapters.process import Form, end_function_process, function_process
from tests.own import own_module
from tests.wrong_input import assert_one_sentence

BAD_DESCRIPTOR = os.strerror(errno.EBADF)
FORM = Form("--estimator", "(image, camera, target)", 3)
MISCHIEF = """
    import os, signal, sys, time
    import numpy as np

    def act(image, camera, target):
        if image == "exit":
            os._exit(3)
        if image == "leave":
            sys.exit(4)
        if image == "hang":
            while True:
                pass
        if image == "crash":
            os.kill(os.getpid(), signal.SIGSEGV)
        if image == "fork":
            os.fork()
        if image == "fork and stay":
            if os.fork() == 0:
                time.sleep(600)
        if image == "infinite":
            return np.eye(3), [np.inf, 0.0, 1.0]
        if image == "far":
            return np.eye(3), [1e200, 0.0, 1.0]
        if image == "interrupt":
            raise KeyboardInterrupt
        if image == "print":
            print("so many words")
        if image == "recurse":
            return act(image, camera, target)
        if image == "take 10 GB":
            return bytearray(10**10)
        if image == "recurse on":
            sys.setrecursionlimit(10**9)
            return act(image, camera, target)
        if image == "keep":
            act.kept = np.ones(5 * 10**6)
            return bytearray(10**8)
        if image == "close":
            for number in range(3, 50):
                try:
                    os.close(number)
                except OSError:
                    pass
        return np.eye(3), [0.0, 0.0, 1.0]
"""
ENDS = {
    "exit": "ended its process, which ended with exit code 3",
    "leave": "SystemExit: 4",
    "hang": "took longer than 2 s",
    "crash": "ended its process, which was ended by SIGSEGV",
    "infinite": "a pose that is not finite or out of all bounds, with the status ok",
    "far": "a pose that is not finite or out of all bounds, with the status ok",
    "interrupt": "RaisedToEndError: KeyboardInterrupt",
    "recurse": "RecursionError: maximum recursion depth exceeded",
}
HARMLESS = ("fork", "fork and stay", "print", "")


@contextlib.contextmanager
def closing_process(name, limits=DEFAULT):
    yield function_process(name, FORM, limits)
    end_function_process()


@pytest.fixture
def name(tmp_path, monkeypatch):
    return f"{own_module(tmp_path, monkeypatch, MISCHIEF)}:act"


def test_whatever_a_function_does_is_a_status(name, capfd):
    with closing_process(name, Limits(2.0)) as called:
        for image in (*ENDS, *HARMLESS):
            notes = []
            answer = called.call(notes.append, image, None, None)
            assert answer.status == ("solver_error" if image in ENDS else "ok"), image
            assert [note.startswith(ENDS[image]) for note in notes] == ([True] if image in ENDS else [])
            assert called.call(notes.append, "", None, None).status == "ok"
    out, err = capfd.readouterr()
    assert out == ""  # which tables and JSON go to
    assert err == "so many words\n"


def test_a_process_that_loses_its_pipe_is_a_status(name, capfd):
    with closing_process(name) as called:
        assert called.call(lambda _: None, "close", None, None).status == "solver_error"
        assert called.call(lambda _: None, "", None, None).status == "ok"
    assert capfd.readouterr().err == f"--estimator {name} broke its own process (OSError: [Errno 9] {BAD_DESCRIPTOR})\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("import os; os._exit(0)", "importing it failed: it ended its process, which ended with exit code 0"),
        ("import time; time.sleep(600)", "importing it failed: it took longer than 1 s"),
        (
            "bytearray(10**10)",
            "importing it failed: it ran out of memory, of which --memory-mb allows 1500 MB; mend it",
        ),
        ("raise KeyboardInterrupt", "importing it failed with KeyboardInterrupt; mend it"),
        ("1 / 0", "failed with ZeroDivisionError: division by zero"),
    ],
)
def test_a_module_that_does_harm_when_imported_is_a_sentence(text, words, tmp_path, monkeypatch):
    module = own_module(tmp_path, monkeypatch, text)
    # Enough to start and import on a busy machine, but for the one that never ends.
    monkeypatch.setattr(process, "START_S", 1.0 if "sleep" in text else 10.0)
    with pytest.raises(UserError, match=words):
        function_process(f"{module}:act", FORM, Limits(1.0))


@pytest.mark.parametrize("limit", [0.0, -1.0, float("nan"), float("inf"), 1e9])
def test_a_time_limit_that_is_none(limit):
    with pytest.raises(UserError, match="give seconds above 0"):
        Limits(limit)


@pytest.mark.parametrize("limit", [-1, 0, 99, 10**9])
def test_a_limit_of_memory_that_is_none(limit):
    with pytest.raises(UserError, match=f"--memory-mb {limit}: give MB from 100 to 10000000, as 1500"):
        Limits(memory_mb=limit)


@pytest.mark.skipif(sys.platform != "linux", reason="the limit is Linux's")
def test_a_function_that_takes_too_much_memory_is_a_status(name):
    """Its process is another one afterwards, without what the function has kept. The limit is small to be met soon.

    Where an interpreter runs out of memory in a call of Python's, it may raise a SystemError instead.
    """
    with closing_process(name, Limits(60.0, memory_mb=100)) as called:
        for image in ("take 10 GB", "keep", "recurse on"):
            notes = []
            assert called.call(notes.append, image, None, None).status == "solver_error"
            assert notes == ["ran out of memory, of which --memory-mb allows 100 MB"] or (
                image == "recurse on" and notes[0].startswith("SystemError")
            )
            assert called.call(notes.append, "", None, None).status == "ok"


@pytest.mark.full
@pytest.mark.skipif(sys.platform != "linux", reason="the limit is Linux's")
def test_the_memory_of_a_function_is_an_option_or_a_variable(root, cli, tmp_path, monkeypatch):
    text = "def solve(a, b, camera):\n    bytearray(3 * 10**8)\n    return None\n"
    name = f"{own_module(tmp_path, monkeypatch, text)}:solve"
    done = cli("estimate", root, "--solver", name, "--overwrite", "-q")
    assert (done.code, done.err) == (0, "")
    monkeypatch.setenv("EPOSIT_MEMORY_MB", "200")
    done = cli("estimate", root, "--solver", name, "--overwrite", "-q")
    assert "frame 0: ran out of memory, of which --memory-mb allows 200 MB" in done.err
    done = cli("estimate", root, "--solver", name, "--overwrite", "--memory-mb", 400, "-q")
    assert (done.code, done.err) == (0, "")


@pytest.mark.full
def test_a_function_that_hangs_in_a_dataset(root, cli, tmp_path, monkeypatch):
    module = own_module(tmp_path, monkeypatch, "import time\ndef solve(a, b, camera):\n    time.sleep(600)\n")
    done = cli("estimate", root, "--solver", f"{module}:solve", "--timeout", "5", "-q")
    assert done.code == 0
    assert "2 of 2 rows have the status solver_error; frame 0: took longer than 5 s" in done.err
    done = cli("estimate", root, "--solver", f"{module}:solve", "--timeout", "0", "-q")
    assert_one_sentence(done.code, done.err, "--timeout 0: give seconds above 0")
