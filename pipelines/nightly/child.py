"""A process that runs other code: limited in time, and gone with everything that it started."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any


def run(command: Sequence[str], limit_s: float) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, without anything to read.

    Raises:
        subprocess.TimeoutExpired: it took longer; then it and its own processes are killed.
    """
    with started(command, stdin=subprocess.DEVNULL) as process:
        out, err = process.communicate(timeout=limit_s)
        return subprocess.CompletedProcess(command, process.returncode, out, err)


@contextmanager
def started(command: Sequence[str], **pipes: Any) -> Iterator[subprocess.Popen[str]]:
    """A process in a group of its own, which is killed at the end: workers would outlive a parent that is killed."""
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True, **pipes
    ) as process:
        try:
            yield process
        finally:
            kill(process)


def kill(process: subprocess.Popen[str]) -> None:
    """Kill a process of `started`, if it still runs, and its own processes."""
    try:
        os.killpg(process.pid, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        process.kill()
