"""Runs that are killed, signalled or find the disk full, and go on: `python -m tests.hostile.interruptions --kills 40`.

Each run is a forked process of its own session, so that the imports are paid once; what is killed among the imports is
in tests/pipelines/test_endings.py.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

from datasets.store.dataset import open_dataset
from datasets.verify import verify
from pipelines.__main__ import main as pipelines
from tests.conftest import TINY
from tests.hostile.__main__ import warmed
from tests.hostile.running import adopt_orphans, orphans
from tests.signals import heed_signals, noted_signals
from tests.wrong_input import left_behind

LIMIT_S = 300.0
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
LEAST_FILE, MOST_FILE = 1_000, 200_000  # bytes, of the limit on one file
LEAST_DISK, MOST_DISK = 8_000, 700_000  # bytes, of a file system in memory


def main() -> int:
    """Run the cases; the exit code is 1 if any has a fault."""
    parser = argparse.ArgumentParser(prog="python -m tests.hostile.interruptions", description=__doc__)
    for name in ("kills", "signals", "files", "disks"):
        parser.add_argument(f"--{name}", type=int, default=0, help="so many runs")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    done: Counter[str] = Counter()
    faults = 0
    with tempfile.TemporaryDirectory(prefix="interrupted-") as folder:
        for fault in _all(asked, Path(folder), done):
            faults += 1
            print(f"FAULT {fault}", flush=True)
    told = {"kills": "kills", "signals": "signals", "files": "limits on files", "disks": "full disks"}
    print(", ".join(f"{done[name]} of {getattr(asked, name)} {text}" for name, text in told.items()))
    print(f"{faults} faults")
    return 1 if faults else 0


def _all(asked: argparse.Namespace, folder: Path, done: Counter[str]) -> Iterator[str]:
    """What is wrong, case by case. done: how many cases of each kind have ended, to be counted up.

    A signal to this process ends it after the case that runs.
    """
    warmed(folder)
    adopt_orphans()
    recipe = folder / "recipe.toml"
    recipe.write_text(TINY)
    begin = time.monotonic()
    code, error = ended(started(recipe, folder / "undisturbed", folder), folder)
    if code:
        raise SystemExit(f"an undisturbed run ended with {code}: {error}")
    seconds, wanted = time.monotonic() - begin, content(folder / "undisturbed")
    print(f"an undisturbed run takes {seconds:.1f} s; content {wanted}", flush=True)
    draw, stopped = random.Random(asked.seed), noted_signals()
    for name, case in _cases(asked, recipe, folder, wanted, lambda: draw.uniform(0.0, seconds)):
        if stopped:
            return
        yield from case
        done[name] += 1
        print(f"{name} {done[name]} of {getattr(asked, name)}", flush=True)


def _cases(
    asked: argparse.Namespace, recipe: Path, folder: Path, wanted: str, moment: Callable[[], float]
) -> Iterator[tuple[str, Iterator[str]]]:
    """The kind of each case, and the case, which runs while its faults are taken."""
    for number in range(asked.kills):
        yield "kills", _stopped(recipe, folder / f"kill{number}", wanted, moment(), signal.SIGKILL)
    for number in range(asked.signals):
        yield "signals", _stopped(recipe, folder / f"signal{number}", wanted, moment(), SIGNALS[number % 3])
    for number in range(asked.files):
        size = _between(number, asked.files, LEAST_FILE, MOST_FILE)
        yield "files", _limited(recipe, folder / f"file{number}", folder, wanted, size)
    for number in range(asked.disks):
        size = _between(number, asked.disks, LEAST_DISK, MOST_DISK)
        yield "disks", _full(recipe, folder / f"disk{number}", folder, wanted, size)


def _stopped(recipe: Path, root: Path, wanted: str, moment: float, number: signal.Signals) -> Iterator[str]:
    yield from _killed(recipe, root, root.parent, moment, number)
    yield from _resumed(recipe, root, root.parent, wanted, f"{number.name} after {moment:.2f} s")


def started(recipe: Path, root: Path, folder: Path, before: Callable[[], None] = heed_signals) -> int:
    """The process id of a forked `run`. before: called in it."""
    told = folder / "stderr"
    pid = os.fork()
    if pid:
        return pid
    code = 99
    try:
        os.setsid()
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        os.dup2(os.open(told, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), 2)
        before()
        sys.argv = ["pipelines", "run", str(recipe), "--out", str(root), "--quiet"]
        code = pipelines()
        sys.stderr.flush()
    finally:
        os._exit(code)


def ended(pid: int, folder: Path) -> tuple[int, str]:
    """Exit code of a process, below 0 for a signal, and what it wrote to stderr."""
    deadline = time.monotonic() + LIMIT_S
    while True:
        found, status = os.waitpid(pid, os.WNOHANG)
        if found:
            return os.waitstatus_to_exitcode(status), (folder / "stderr").read_text(errors="replace")
        if time.monotonic() > deadline:
            os.killpg(pid, signal.SIGKILL)
        time.sleep(0.005)


def _killed(recipe: Path, root: Path, folder: Path, moment: float, number: signal.Signals) -> Iterator[str]:
    """A run that gets a signal at a moment, with its whole session as from a terminal."""
    what = f"{number.name} after {moment:.2f} s"
    pid = started(recipe, root, folder)
    time.sleep(moment)
    with contextlib.suppress(ProcessLookupError):
        os.killpg(pid, number)
    code, error = ended(pid, folder)
    if number != signal.SIGKILL and code not in (0, 128 + number, -number):
        yield f"{what}: exit code {code}: {error[-300:]}"
    if code == 128 + number and not (
        f"stopped by {number.name}; to go on, run again: " in error and "Traceback" not in error
    ):
        yield f"{what}: {error[-300:]}"
    if orphans():
        yield f"{what}: processes were left behind"


def _limited(recipe: Path, root: Path, folder: Path, wanted: str, size: int) -> Iterator[str]:
    """A run in which no file may be larger than a limit: writing stops in the middle."""

    def limit() -> None:
        heed_signals()
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    yield from _refused(*ended(started(recipe, root, folder, limit), folder), f"files of {size} bytes", root)
    yield from _resumed(recipe, root, folder, wanted, f"files of {size} bytes")


def _full(recipe: Path, root: Path, folder: Path, wanted: str, size: int) -> Iterator[str]:
    """A run on a file system in memory that is too small, which then grows."""
    what = f"a disk of {size} bytes"
    root.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(root)], check=True)
    try:
        yield from _refused(*ended(started(recipe, root / "out", folder), folder), what, root)
        subprocess.run(["mount", "-o", "remount,size=64m", str(root)], check=True)
        yield from _resumed(recipe, root / "out", folder, wanted, what)
    finally:
        subprocess.run(["umount", str(root)], check=True)


def _refused(code: int, error: str, what: str, root: Path) -> Iterator[str]:
    print(f"{what}: {code} {error.strip()[:160]}", flush=True)
    lines = error.strip().splitlines()
    if code not in (0, 2) or (code == 2 and not (len(lines) == 1 and lines[0].startswith("error: cannot write "))):
        yield f"{what}: exit code {code}: {error[-300:]}"
    if [*root.rglob(".tmp-*")]:
        yield f"{what}: temporary files are left"


def _resumed(recipe: Path, root: Path, folder: Path, wanted: str, what: str) -> Iterator[str]:
    """The same command again ends with the content of an undisturbed run."""
    code, error = ended(started(recipe, root, folder), folder)
    if code:
        yield f"{what}, resumed: exit code {code}: {error[-300:]}"
    elif content(root) != wanted:
        yield f"{what}: resumed, the content is another one"
    elif left_behind(root):
        yield f"{what}: resumed, hidden files are left"


def content(root: Path) -> str:
    """Content hash of a dataset, or the first problem that `verify` finds in it."""
    digest, problems = verify(open_dataset(root))
    return problems[0].text if problems else digest


def _between(number: int, count: int, least: int, most: int) -> int:
    """Sizes that grow by a factor."""
    return int(least * (most / least) ** (number / max(1, count - 1)))


if __name__ == "__main__":
    sys.exit(main())
