"""Who writes a dataset: one process, or several that share it on purpose.

    with hold(root):                # alone; every command that writes does this
        ...
    with hold(root, shared=True):   # beside others that hold it shared, as the processes of one `--shard` job do
        ...

`claim(root, recipe, text, shared=...)` of `datasets.store.claim` does the same and binds the folder to a recipe first;
processes that share a folder all call it so, with one recipe. Workers of an engine take no lock: they work for the
process that has it. Those who only read (`verify`, `report`) need none, as every file is replaced atomically.

How it works. A holder lays a file `.lock-HOST-PID-RANDOM` of its own into the folder, which tells who it is, and keeps
it locked with `flock`; then it looks for the files of others. If one of them may not stand beside it, it takes its own
away again and refuses. Each announces itself before it looks, so of two at once at least one sees the other: never do
both go on. Since both may withdraw, a withdrawn one tries again after a random time, unless the other has been there
for long.

A file whose process has ended is removed: the kernel gave its `flock` back, also after kill -9, after a restart of
the machine and in another container, where a process id says nothing. As no name is used twice, removing one never
removes a live one. `flock` cannot be asked across machines on every file system, so a file of another host is believed
until somebody deletes it, and the sentence names it.
"""

from __future__ import annotations

import datetime
import json
import os
import random
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from datasets.errors import UserError
from datasets.store.atomic import State, create_owned, host, own_name, state_of
from datasets.store.refusals import refused
from datasets.url_path import UrlPath

LOCK_PREFIX = ".lock-"
BEGIN_PREFIX = ".tmp-"  # a lock file until it is whole, swept like every temporary file
PATIENCE_S = 1.0  # how long one tries that meets another who has just begun
PAUSE_S = 0.05  # mean time between two tries; an announcement takes less than a millisecond


class HeldError(UserError):
    """Another process writes the dataset."""


@dataclass(frozen=True, slots=True)
class Holder:
    """Who holds a dataset."""

    host: str
    pid: int
    since: str  # UTC, to the second
    command: str
    shared: bool


@contextmanager
def hold(root: Path, *, shared: bool = False) -> Iterator[None]:
    """Hold a dataset's folder, which is there, while the body runs.

    Nobody holds one in an object store, which has no locks: there all share it, as the files of two who do the same
    are the same.

    shared: others that hold it shared may stand beside; alone: nobody.

    Raises:
        HeldError: another holds it: who, since when and what to do.
        UserError: the folder cannot be written.
    """
    if isinstance(root, UrlPath):
        yield
        return
    try:
        path, descriptor = _take(root, shared)
    except OSError as error:
        raise refused(root, error) from error
    try:
        yield
    finally:
        _give_back(path, descriptor)


def _take(root: Path, shared: bool) -> tuple[Path, int]:
    deadline = time.monotonic() + PATIENCE_S
    while True:
        path, descriptor = _announce(root, shared)
        try:
            rival = next(_rivals(root, path, shared), None)
        except BaseException:
            _give_back(path, descriptor)
            raise
        if rival is None:
            return path, descriptor
        _give_back(path, descriptor)
        if time.monotonic() > deadline or _has_settled(rival[0]):
            raise _held(root, *rival)
        time.sleep(random.uniform(0.0, 2.0 * PAUSE_S))


def _announce(root: Path, shared: bool) -> tuple[Path, int]:
    """A lock file of this process, whole and held from the moment that it has its name."""
    now = datetime.datetime.now(datetime.UTC).isoformat(sep=" ", timespec="seconds")
    holder = Holder(host(), os.getpid(), now, _command(), shared)
    temporary, descriptor = create_owned(root, BEGIN_PREFIX)
    try:
        os.write(descriptor, json.dumps(asdict(holder)).encode())
        path = root / own_name(LOCK_PREFIX)
        temporary.rename(path)
    except BaseException:
        _give_back(temporary, descriptor)
        raise
    return path, descriptor


def _give_back(path: Path, descriptor: int) -> None:
    path.unlink(missing_ok=True)
    os.close(descriptor)


def _rivals(root: Path, own: Path, shared: bool) -> Iterator[tuple[Path, Holder]]:
    """The holders that may not stand beside; files of ended processes are removed."""
    for path in sorted(root.glob(f"{LOCK_PREFIX}*")):
        if path == own:
            continue
        if state_of(path) is State.GONE:
            path.unlink(missing_ok=True)
            continue
        try:
            holder = Holder(**json.loads(path.read_text(encoding="utf-8")))
        except FileNotFoundError:
            continue
        except (ValueError, TypeError):
            holder = Holder("unknown", 0, "unknown", "unknown", shared=False)
        if not (shared and holder.shared):
            yield path, holder


def _has_settled(path: Path) -> bool:
    """Whether a lock is older than the time in which two may withdraw for each other."""
    try:
        return time.time() - path.stat().st_mtime > PATIENCE_S
    except FileNotFoundError:
        return False


def _held(root: Path, path: Path, holder: Holder) -> HeldError:
    who = f"`{holder.command}` (process {holder.pid} on {holder.host}, since {holder.since} UTC)"
    advice = "wait until it has ended"
    if state_of(path) is State.UNKNOWN:
        advice += f", or delete {path} if it no longer runs there"
    return HeldError(f"{root} is being written by {who}; {advice}, or choose another folder")


def _command() -> str:
    """This process as it was called, without folders."""
    words = [Path(sys.argv[0]).parent.name if sys.argv[0].endswith("__main__.py") else Path(sys.argv[0]).name]
    return " ".join([*words, *sys.argv[1:]])[:200]
