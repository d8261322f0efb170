"""One hostile case in a forked process with limits, and what is wrong with how it ended.

The libraries are imported once, by who forks, so that a case costs what its command does.
"""

from __future__ import annotations

import ctypes
import os
import random
import resource
import shutil
import signal
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import pytest

from pipelines.endings import UNFINISHED, USER_ERROR
from tests.conftest import command
from tests.signals import heed_signals
from tests.wrong_input import Place

LIMIT_S = 120.0
MOST_RSS = 2 * 2**30  # bytes of memory that any case may take
ADDRESS_SPACE = 6 * 2**30  # beyond what is mapped already: a case that asks for more than this gets a MemoryError
FILE_BYTES = 2**30  # of one file that a case may write
LONGEST_LINE = 2500  # letters of an error: one that repeats a whole file is no sentence
ALLOWED = (0, USER_ERROR, UNFINISHED)
BAD_WORDS = ("Traceback (most recent", "Warning:", "terminate called", "core dumped")
CALLS = "calls.txt"
PR_SET_CHILD_SUBREAPER = 36
Call = Sequence[object] | Callable[[], int]  # the words of a command, or a function that gives an exit code


@dataclass
class Outcome:
    """How a case ended."""

    what: str
    codes: list[int]
    errors: list[str]  # what each call wrote to stderr
    seconds: float
    rss: int
    faults: list[str] = field(default_factory=list)


def adopt_orphans() -> None:
    """Processes that a case leaves behind become children of this one, which counts and ends them."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def run_case(kind: ModuleType, seed: str, source: Path, text: str, folder: Path) -> Outcome:
    """Fork, make the case from its seed, do its calls, and judge. source: a finished dataset; text: its recipe."""
    shutil.rmtree(folder, ignore_errors=True)
    for name in ("work", "outside", "tmp", "told"):
        (folder / name).mkdir(parents=True)
    (folder / "outside" / "precious.txt").write_text("not to be touched")
    begin = time.monotonic()
    pid = os.fork()
    if pid == 0:
        _child(kind, seed, source, text, folder)
    status, usage, late = _wait(pid, begin + LIMIT_S * getattr(kind, "PATIENCE", 1))
    rss = usage.ru_maxrss * 1024
    outcome = _outcome(folder, time.monotonic() - begin, rss)
    if rss > MOST_RSS:
        outcome.faults.append(f"took {rss / 2**20:.0f} MB")
    outcome.faults += [f"no end within {outcome.seconds:.0f} s"] if late else _ending(status)
    left = orphans()
    if left:
        outcome.faults.append(f"{left} processes were left behind")
    return outcome


def _child(kind: ModuleType, seed: str, source: Path, text: str, folder: Path) -> None:
    code = 99
    try:
        os.setsid()
        heed_signals()
        os.chdir(folder / "work")
        os.environ["TMPDIR"] = str(folder / "tmp")
        _limit()
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(os.open(folder / "told" / "out", os.O_WRONLY | os.O_CREAT | os.O_APPEND), 1)
        place = Place(folder / "work", text, source, pytest.MonkeyPatch())
        what, calls = kind.make(random.Random(seed), place)
        (folder / "told" / "what").write_text(what, errors="backslashreplace")
        for number, call in enumerate(calls):
            _do(call, folder / "told", number)
        code = 0
    except BaseException:
        with open(folder / "told" / "harness", "w", encoding="utf-8", errors="backslashreplace") as file:
            traceback.print_exc(file=file)
    finally:
        os._exit(code)


def _do(call: Call, told: Path, number: int) -> None:
    """One call with its own file of errors; its exit code goes to the list."""
    sys.stderr.flush()
    os.dup2(os.open(told / f"err-{number:02d}", os.O_WRONLY | os.O_CREAT | os.O_APPEND), 2)
    try:
        code = call() if callable(call) else command(*call)
    except BaseException:
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    with open(told / CALLS, "a", encoding="utf-8") as file:
        file.write(f"{code}\n")


def _limit() -> None:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    size = pages * resource.getpagesize() + ADDRESS_SPACE
    resource.setrlimit(resource.RLIMIT_AS, (size, size))
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_BYTES, FILE_BYTES))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _wait(pid: int, deadline: float) -> tuple[int, resource.struct_rusage, bool]:
    pause = 0.002
    while True:
        found, status, usage = os.wait4(pid, os.WNOHANG)
        if found:
            return status, usage, False
        if time.monotonic() > deadline:
            os.killpg(pid, signal.SIGKILL)
            _, status, usage = os.wait4(pid, 0)
            return status, usage, True
        time.sleep(pause)
        pause = min(0.1, pause * 1.3)


def orphans() -> int:
    """How many processes still run that a case has started; they are ended."""
    time.sleep(0.02)
    count, children = 0, Path(f"/proc/self/task/{os.getpid()}/children")
    deadline = time.monotonic() + 2.0
    while children.read_text().split() and time.monotonic() < deadline:
        if not _reaped():
            time.sleep(0.05)
    for pid in map(int, children.read_text().split()):
        count += 1
        os.kill(pid, signal.SIGKILL)
        os.waitpid(pid, 0)
    return count


def _reaped() -> bool:
    try:
        return os.waitpid(-1, os.WNOHANG)[0] != 0
    except ChildProcessError:
        return False


def _ending(status: int) -> list[str]:
    if os.WIFSIGNALED(status):
        return [f"ended by {signal.Signals(os.WTERMSIG(status)).name}"]
    return [] if os.WEXITSTATUS(status) == 0 else [f"ended its process with exit code {os.WEXITSTATUS(status)}"]


def _outcome(folder: Path, seconds: float, rss: int) -> Outcome:
    told = folder / "told"
    what = _text(told / "what") or "(not made)"
    codes = [int(line) for line in _text(told / CALLS).split()]
    errors = [_text(path) for path in sorted(told.glob("err-*"))]
    outcome = Outcome(what, codes, errors, seconds, rss)
    faults = outcome.faults
    if (told / "harness").exists():
        faults.append(f"the case could not be made: {_text(told / 'harness')[-1500:]}")
    faults += [f"exit code {code}" for code in codes if code not in ALLOWED]
    for code, error in zip(codes, errors, strict=False):
        faults += _faults_of_words(code, error)
    if [path.name for path in (folder / "outside").iterdir()] != ["precious.txt"] or _text(
        folder / "outside" / "precious.txt"
    ) != "not to be touched":
        faults.append("a file outside its folder was touched")
    faults += [f"left {path.name} in the folder of temporary files" for path in (folder / "tmp").glob("*")]
    if {path.name for path in folder.iterdir()} != {"work", "outside", "tmp", "told"}:
        faults.append("a file beside its folder was made")
    return outcome


def _faults_of_words(code: int, error: str) -> list[str]:
    faults = [f"stderr says {word!r}" for word in BAD_WORDS if word in error]
    if code == 0:
        return faults
    lines = error.strip().splitlines()
    is_usage = bool(lines) and lines[0].startswith("Usage: ")
    if not is_usage and not any(line.startswith("error: ") for line in lines):
        faults.append("no sentence beginning with 'error: '")
    longest = max((len(line) for line in lines if line.startswith("error: ")), default=0)
    if longest > LONGEST_LINE:
        faults.append(f"a sentence of {longest} letters")
    return faults


def _text(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""
