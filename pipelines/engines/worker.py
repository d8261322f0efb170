"""A worker process: it does tasks until its pipe closes, and ends when its parent does, in whatever way."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any

PR_SET_PDEATHSIG = 1  # of Linux's prctl


def serve(pipe: Connection, run_one: Callable[[Any], Any]) -> None:
    """Receive tasks; send back (result, None, "") of each, or (None, exception, traceback)."""
    end_with_parent()
    if hasattr(signal, "pthread_sigmask"):  # its parent held it back while it started this process
        signal.pthread_sigmask(signal.SIG_UNBLOCK, (signal.SIGTERM,))
    while True:
        try:
            task = pipe.recv()
        except EOFError:
            return
        pipe.send(_outcome(run_one, task))


def end_with_parent() -> None:
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


def _outcome(run_one: Callable[[Any], Any], task: Any) -> tuple[Any, BaseException | None, str]:
    try:
        return run_one(task), None, ""
    except Exception as error:
        return None, _picklable(error), traceback.format_exc()


def _picklable(error: Exception) -> Exception:
    """The error itself, or what it says where it cannot go through a pipe."""
    from multiprocessing.reduction import ForkingPickler

    try:
        ForkingPickler.loads(ForkingPickler.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
