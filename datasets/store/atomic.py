"""Atomic files: a temporary name beside the target, flushed to disk, then renamed.

A file that belongs to one process while it is written says so twice. Its name holds the host, the process id and a
random number, so that no two processes, on whatever node, ever choose the same. And the process holds it locked with
`flock`, which the kernel releases when the process ends in whatever way. So whether a file is abandoned is a question
to the kernel: process ids are used again, and mean nothing in another container or on another node.
"""

from __future__ import annotations

import itertools
import os
import platform
import re
import secrets
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path

from datasets.store.refusals import refused
from datasets.url_path import UrlPath

try:
    import fcntl
except ImportError:  # a system without flock: files of others are then never taken for abandoned
    fcntl = None

TEMPORARY_PREFIX = ".tmp-"
SCRATCH_PREFIX = (
    ".eposit-"  # of files among the machine's temporary ones: out of an archive, to or from an object store
)
OWN_NAME = re.compile(r"\.[a-z]+-(?P<host>.+)-\d+-[0-9a-f]{16}")
NAME_LIMIT = 64  # letters of a host's name, and of a target's name, in a temporary one: 255 bytes is a name's limit
TRIES = 100


class State(Enum):
    """What is known of the process that a file belongs to."""

    LIVE = "live"  # it holds the file
    GONE = "gone"  # it ended and left the file behind
    UNKNOWN = "unknown"  # on another host, or on a file system that cannot tell


def host() -> str:
    """This machine's name, in letters that a file's name can have."""
    return re.sub(r"[^A-Za-z0-9._-]", "_", platform.node())[:NAME_LIMIT] or "unknown"


def own_name(prefix: str) -> str:
    """A name that no other process, and no other call, chooses."""
    return f"{prefix}{host()}-{os.getpid()}-{secrets.token_hex(8)}"


def create_owned(folder: Path, prefix: str, suffix: str = "") -> tuple[Path, int]:
    """A new empty file of a name of its own, and its descriptor, which holds it until it is closed.

    Raises:
        OSError: the system refuses.
    """
    for _ in range(TRIES):
        path = folder / f"{own_name(prefix)}{suffix}"
        descriptor = os.open(path, os.O_CREAT | os.O_EXCL | os.O_RDWR | getattr(os, "O_CLOEXEC", 0), 0o666)
        # Between creation and the lock a sweep may take the file for abandoned: then it is gone, and another is made.
        if _try_lock(descriptor, alone=True) is not State.LIVE and os.fstat(descriptor).st_nlink:
            return path, descriptor
        os.close(descriptor)
    raise OSError(f"no temporary file can be kept in {folder}")


def state_of(path: Path) -> State:
    """Whether the process that a file of `create_owned` belongs to still runs. A file that is not there: GONE."""
    name = OWN_NAME.match(path.name)
    if name and name["host"] != host():
        return State.UNKNOWN
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except FileNotFoundError:
        return State.GONE
    except OSError:
        return State.UNKNOWN
    try:
        return _try_lock(descriptor, alone=False)  # two who ask at once do not hinder each other
    finally:
        os.close(descriptor)


def _try_lock(descriptor: int, *, alone: bool) -> State:
    """Lock a file: LIVE if another process holds it, GONE if none does, UNKNOWN if the file system has no locks."""
    if fcntl is None:
        return State.UNKNOWN
    try:
        fcntl.flock(descriptor, (fcntl.LOCK_EX if alone else fcntl.LOCK_SH) | fcntl.LOCK_NB)
    except BlockingIOError:
        return State.LIVE
    except OSError:
        return State.UNKNOWN
    return State.GONE


def sweep(root: Path) -> None:
    """Remove the temporary files whose process of this host has ended, under a folder and among the machine's own.

    Those of other processes stay. In an object store there are none.
    """
    below = [] if isinstance(root, UrlPath) else root.rglob(f"{TEMPORARY_PREFIX}*")
    for path in itertools.chain(below, Path(tempfile.gettempdir()).glob(f"{SCRATCH_PREFIX}*")):
        if path.is_file() and state_of(path) is State.GONE:
            path.unlink(missing_ok=True)


@contextmanager
def replace_atomically(path: Path) -> Iterator[Path]:
    """A temporary path to write to; on success it takes the place of `path`, on failure nothing changes.

    The file is there already and is to be written in place: a new file of that name would not be held. That of an
    object store lies on this machine and is put as a whole.
    """
    if isinstance(path, UrlPath):
        with _scratch_file(path.name) as temporary:
            yield temporary
            path.put(temporary)
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary, descriptor = create_owned(path.parent, TEMPORARY_PREFIX, f"-{path.name[-NAME_LIMIT:]}")
    try:
        yield temporary
        os.fsync(descriptor)
        temporary.replace(path)
    finally:
        os.close(descriptor)
        temporary.unlink(missing_ok=True)


def copy_file(source: Path, path: Path) -> None:
    """Write a file with the content of another, as a whole; each may lie in an object store.

    Raises:
        OSError: the system refuses.
    """
    with local_copy(source) as here:
        if isinstance(path, UrlPath):
            path.put(here)
            return
        with replace_atomically(path) as temporary:
            shutil.copyfile(here, temporary)


@contextmanager
def local_copy(path: Path) -> Iterator[Path]:
    """A file of this machine with the content of one that may lie in an object store, for libraries that need it.

    Raises:
        OSError: it cannot be read, or the disk for temporary files refuses.
    """
    if not isinstance(path, UrlPath):
        yield path
        return
    with local_file(path.read_bytes(), path.name) as here:
        yield here


@contextmanager
def local_file(content: bytes, name: str) -> Iterator[Path]:
    """A file of this machine with some content, for libraries that read nothing else. name: at the end of its own.

    Raises:
        OSError: the disk for temporary files refuses.
    """
    with _scratch_file(name) as temporary:
        temporary.write_bytes(content)
        yield temporary


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file that is never half there.

    Raises:
        OSError: the system refuses.
    """
    with replace_atomically(path) as temporary:
        temporary.write_bytes(content)


@contextmanager
def _scratch_file(name: str) -> Iterator[Path]:
    """A new file of this machine, removed at the end; the next `sweep` removes that of a process that was killed."""
    path, descriptor = create_owned(Path(tempfile.gettempdir()), SCRATCH_PREFIX, f"-{name[-NAME_LIMIT:]}")
    try:
        yield path
    finally:
        os.close(descriptor)
        path.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write a file that is never half there.

    Raises:
        UserError: the disk refuses.
    """
    try:
        with replace_atomically(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    except OSError as error:
        raise refused(path, error) from error


def create_text(path: Path, text: str) -> bool:
    """Write a file unless one is there; of several who try at once one does. Whether this call did.

    In an object store several who try at once may all do, and the last one's text stays.

    Raises:
        UserError: the disk refuses.
    """
    if isinstance(path, UrlPath):
        if path.is_file():
            return False
        write_text(path, text)
        return True
    try:
        temporary, descriptor = create_owned(path.parent, TEMPORARY_PREFIX)
        try:
            temporary.write_text(text, encoding="utf-8")
            os.fsync(descriptor)
            _link(temporary, path)
        finally:
            os.close(descriptor)
            temporary.unlink(missing_ok=True)
    except FileExistsError:
        return False
    except OSError as error:
        raise refused(path, error) from error
    return True


def _link(source: Path, path: Path) -> None:
    try:
        os.link(source, path)
    except FileExistsError:
        raise
    except OSError:  # a file system without links: a reader may then see the file half written
        with open(path, "x", encoding="utf-8") as file:
            file.write(source.read_text(encoding="utf-8"))
