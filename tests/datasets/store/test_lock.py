"""Two writers never hold one folder, unless both share it; what ended processes left is no obstacle."""

from __future__ import annotations

import json
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from datasets.errors import UserError
from datasets.recipe.model import parse_recipe
from datasets.store import atomic, lock
from datasets.store.atomic import replace_atomically, state_of, sweep
from datasets.store.claim import claim
from datasets.store.lock import LOCK_PREFIX, hold
from tests.conftest import TINY
from tests.wrong_input import assert_one_sentence

ROOT = Path(__file__).parents[3]
RECIPES = [parse_recipe(TINY.replace("seed = 5", f"seed = {seed}"), "tiny") for seed in range(2)]
KILLED = "import os, pathlib, signal, sys\nfrom datasets.store.lock import hold\nroot = pathlib.Path(sys.argv[1])\n"


def in_process(text, root):
    """A process of its own that runs a Python text, with its output."""
    done = [sys.executable, "-c", KILLED + text, str(root)]
    return subprocess.Popen(done, cwd=ROOT, stdout=subprocess.PIPE, text=True)


def killed_holder(root):
    """A process takes the lock and is killed."""
    process = in_process("with hold(root):\n    os.kill(os.getpid(), signal.SIGKILL)\n", root)
    assert process.wait(60) == -signal.SIGKILL
    process.stdout.close()
    (left,) = root.glob(f"{LOCK_PREFIX}*")
    return left


def as_if_of_host(path, name):
    """The same lock file, as a process on another host would have written it."""
    holder = json.loads(path.read_text()) | {"host": name}
    other = path.with_name(path.name.replace(atomic.host(), name))
    path.rename(other)
    other.write_text(json.dumps(holder))
    return other


def test_one_holds_and_another_is_told_by_whom(tmp_path):
    with hold(tmp_path), pytest.raises(UserError) as refusal, hold(tmp_path):
        pass
    assert f"(process {os.getpid()} on {atomic.host()}, since 20" in str(refusal.value)
    assert "wait until it has ended" in str(refusal.value)
    assert "delete" not in str(refusal.value)  # this host knows that the process lives
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_an_error_gives_the_lock_back(error, tmp_path):
    with pytest.raises(error), hold(tmp_path):
        raise error
    assert list(tmp_path.iterdir()) == []
    with hold(tmp_path):
        pass


@pytest.mark.parametrize(("first", "second", "together"), [(1, 1, True), (1, 0, False), (0, 1, False), (0, 0, False)])
def test_only_those_who_share_stand_beside_each_other(first, second, together, tmp_path, monkeypatch):
    monkeypatch.setattr(lock, "PATIENCE_S", 0.0)
    with hold(tmp_path, shared=bool(first)):
        try:
            with hold(tmp_path, shared=bool(second)):
                held = True
        except UserError:
            held = False
    assert held == together


def test_a_lock_lasts_until_the_last_of_those_who_share_it_has_gone(tmp_path, monkeypatch):
    monkeypatch.setattr(lock, "PATIENCE_S", 0.0)
    with hold(tmp_path, shared=True):
        with hold(tmp_path, shared=True):
            pass
        with pytest.raises(UserError), hold(tmp_path):
            pass
    with hold(tmp_path):
        pass


def test_a_killed_process_holds_nothing(tmp_path):
    left = killed_holder(tmp_path)
    with hold(tmp_path):
        assert not left.exists()


def test_who_ends_within_moments_is_waited_for(tmp_path):
    held, result = threading.Event(), []

    def wait():
        held.wait()
        with hold(tmp_path):
            result.append("held")

    thread = threading.Thread(target=wait)
    thread.start()
    with hold(tmp_path):
        held.set()
        time.sleep(0.2)  # much longer than one try, much shorter than the patience
    thread.join()
    assert result == ["held"]


def test_a_lock_of_another_host_is_believed_until_it_is_deleted(tmp_path):
    left = as_if_of_host(killed_holder(tmp_path), "node-7")
    with pytest.raises(UserError) as refusal, hold(tmp_path):
        pass
    assert "on node-7, since" in str(refusal.value)
    assert f"or delete {left} if it no longer runs there" in str(refusal.value)
    left.unlink()
    with hold(tmp_path):
        pass


def test_a_lock_of_another_host_may_share(tmp_path):
    killed = in_process("with hold(root, shared=True):\n    os.kill(os.getpid(), signal.SIGKILL)\n", tmp_path)
    killed.wait(60)
    killed.stdout.close()
    (left,) = tmp_path.glob(f"{LOCK_PREFIX}*")
    other = as_if_of_host(left, "node-7")
    with hold(tmp_path, shared=True):
        assert other.exists()


def test_a_lock_that_nobody_can_read_is_believed(tmp_path):
    (tmp_path / f"{LOCK_PREFIX}node-7-12-{'0' * 16}").write_text("{")
    with pytest.raises(UserError, match="delete"), hold(tmp_path):
        pass


@pytest.mark.parametrize("cause", ["no flock here", "no fcntl"])
def test_without_file_locks_a_file_is_believed(cause, tmp_path, monkeypatch):
    left = killed_holder(tmp_path)
    if cause == "no fcntl":
        monkeypatch.setattr(atomic, "fcntl", None)
    else:
        monkeypatch.setattr(atomic.fcntl, "flock", lambda *_: (_ for _ in ()).throw(OSError(38, "none")))
    with pytest.raises(UserError, match=left.name), hold(tmp_path):
        pass
    left.unlink()
    with hold(tmp_path):
        pass


@pytest.mark.parametrize("shared", [False, True])
def test_of_many_at_once_never_two_hold_unless_they_share(shared, tmp_path):
    """Threads are rivals like processes: each opens its own file. An entry and a missing exit is two at a time."""
    inside, most, done, guard, start = [0], [0], [0], threading.Lock(), threading.Barrier(8)

    def work():
        start.wait()
        try:
            with hold(tmp_path, shared=shared):
                with guard:
                    inside[0] += 1
                    most[0] = max(most[0], inside[0])
                    done[0] += 1
                time.sleep(0.02)
                with guard:
                    inside[0] -= 1
        except UserError:
            pass

    threads = [threading.Thread(target=work) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert list(tmp_path.iterdir()) == []
    assert done[0] == 8 if shared else done[0] >= 1
    assert most[0] > 1 if shared else most[0] == 1


def _claims(root, which, start, told, races):
    recipe = RECIPES[which]
    text = TINY.replace("seed = 5", f"seed = {which}")
    for number in range(races):
        start.wait()
        try:
            with claim(root / str(number), recipe, text, shared=True):
                told.put((number, which))
        except UserError as error:
            told.put((number, str(error)))


@pytest.mark.parametrize("races", [10, pytest.param(300, marks=pytest.mark.slow)])
def test_of_two_recipes_that_claim_a_folder_at_once_one_gets_it(races, tmp_path):
    context = multiprocessing.get_context("spawn")
    start, told = context.Barrier(2), context.Queue()
    both = [context.Process(target=_claims, args=(tmp_path, which, start, told, races)) for which in range(2)]
    for process in both:
        process.start()
    answers = [told.get(timeout=60) for _ in range(2 * races)]
    for process in both:
        process.join()
    for number in range(races):
        winner, loser = sorted(
            (answer for n, answer in answers if n == number), key=lambda answer: isinstance(answer, str)
        )
        assert winner in (0, 1)
        assert "holds a dataset of another recipe" in loser
        assert f"seed = {winner}" in (tmp_path / str(number) / "recipe.toml").read_text()


def test_a_temporary_file_of_a_live_writer_stays(tmp_path):
    path = tmp_path / "frames" / "shard"
    with replace_atomically(path) as temporary:
        temporary.write_bytes(b"half")
        sweep(tmp_path)
        assert temporary.exists()
    assert path.read_bytes() == b"half"
    assert [entry.name for entry in path.parent.iterdir()] == ["shard"]


def test_temporary_files_of_ended_writers_go_and_those_of_other_hosts_stay(tmp_path):
    text = (
        "from datasets.store.atomic import replace_atomically\n"
        "with replace_atomically(root / 'shard'):\n    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    process = in_process(text, tmp_path)
    process.wait(60)
    process.stdout.close()
    (left,) = tmp_path.iterdir()
    other = tmp_path / left.name.replace(atomic.host(), "node-7")
    other.write_bytes(b"")
    sweep(tmp_path)
    assert list(tmp_path.iterdir()) == [other]


def test_two_writers_of_one_file_at_once_leave_one_whole_file(tmp_path):
    path = tmp_path / "shard"
    with replace_atomically(path) as one, replace_atomically(path) as two:
        assert one != two
        one.write_bytes(b"one")
        two.write_bytes(b"two")
    assert path.read_bytes() == b"one"  # renamed last
    assert list(tmp_path.iterdir()) == [path]


def test_a_lock_file_is_gone_when_its_process_is(tmp_path):
    assert state_of(tmp_path / f"{LOCK_PREFIX}{atomic.host()}-1-{'0' * 16}") is atomic.State.GONE


@pytest.mark.usefixtures("no_figures")
def test_a_stage_beside_a_writer_is_refused_and_readers_are_not(root, cli):
    with hold(root):
        for words in (("detect",), ("estimate",), ("score",)):
            outcome = cli(words[0], root)
            assert_one_sentence(outcome.code, outcome.err, f"{root} is being written by")
        assert cli("verify", root).code == 0
        assert cli("report", root).code == 0
