"""Processes that this one starts and talks to, and which end when it does."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from typing import Any

PR_SET_PDEATHSIG = 1  # of Linux's prctl
HELD_BACK = tuple(getattr(signal, name) for name in ("SIGINT", "SIGHUP", "SIGTERM") if hasattr(signal, name))
PATIENCE_S = 5.0  # within which a process that was killed ends
# What a pipe raises whose other end has gone: a reset where something that was sent to it had not been read.
OTHER_END_GONE = (EOFError, BrokenPipeError, ConnectionResetError)


@dataclass
class Child:
    """A process and the pipe to it."""

    process: SpawnProcess
    pipe: Any  # Any: a Connection, on Windows a PipeConnection

    def kill(self, *, group: bool = False) -> None:
        """End the process; group: and those that it has started, if it leads a group of its own."""
        self.pipe.close()
        if group and self.process.pid is not None and hasattr(os, "killpg"):
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)
        self.process.kill()
        self.process.join(PATIENCE_S)

    @property
    def end(self) -> str:
        """How the process ended: `was killed`, `was ended by SIGSEGV` or `ended with exit code 3`."""
        self.process.join(PATIENCE_S)
        code = self.process.exitcode
        if code is None or code >= 0:
            return f"ended with exit code {code}"
        name = signal.Signals(-code).name if -code in list(signal.Signals) else f"signal {-code}"
        return "was killed" if name == "SIGKILL" else f"was ended by {name}"


def start(serve: Callable[..., None], *arguments: Any) -> Child:
    """A new process that calls `serve` with its end of a pipe and the arguments.

    Mitsuba starts threads, which a forked process would not have: it is spawned.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=_served, args=(serve, theirs, arguments))
    with _signals_held_back():
        process.start()
    theirs.close()
    return Child(process, ours)


def _served(serve: Callable[..., None], pipe: Connection, arguments: tuple[Any, ...]) -> None:
    _end_with_parent()
    if hasattr(signal, "pthread_sigmask"):  # the parent held it back while it started this process
        signal.pthread_sigmask(signal.SIG_UNBLOCK, (signal.SIGTERM,))
    serve(pipe, *arguments)


def _end_with_parent() -> None:
    """From now on this process is killed when the one that started it ends, also by kill -9.

    Linux does so itself; elsewhere, and if the parent has ended before that was asked, a thread waits for the pipe that
    the parent holds to close.
    """
    parent = multiprocessing.parent_process()
    if parent is None:
        return
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    threading.Thread(target=_wait_for_end, args=(parent,), daemon=True).start()


def _wait_for_end(parent: Any) -> None:
    parent.join()
    os._exit(1)


@contextmanager
def _signals_held_back() -> Iterator[None]:
    """A process that is started in the body never gets the signals of a terminal: its parent does, and ends it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, HELD_BACK)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
