"""How a command can end otherwise than well: by a signal, by what nobody expected, or with work left to do."""

from __future__ import annotations

import os
import shlex
import signal
import sys
import tempfile
import threading
import time
import traceback
from pathlib import Path
from types import FrameType

USER_ERROR = 2
UNEXPECTED = 70  # EX_SOFTWARE of sysexits.h
UNFINISHED = 75  # EX_TEMPFAIL: the same command may succeed
BY_SIGNAL = 128  # plus the signal's number, as a shell tells it
UNREAD = BY_SIGNAL + 13  # SIGPIPE
SIGNALS = tuple(name for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
LONGEST_LINE = 2000  # letters of a line of an error
AGAIN_S = 0.05  # until a signal comes once more that could not be raised
PATIENCE_S = 5.0  # for what a signal finds at work: native code does not listen


class UnfinishedError(Exception):
    """Some of the work could not be done; the message is one sentence with the command that tries it again."""


class Stopped(BaseException):
    """A signal that ends the program; no `except Exception`, and none for Ctrl-C, takes it for something else."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def own_command() -> str:
    """The command line of this process, as a shell takes it."""
    return f"python -m pipelines {shlex.join(sys.argv[1:])}".rstrip()


def printable(text: str) -> str:
    """A text for a terminal: what would steer it is escaped, and of long lines the middle is left out.

    A sentence repeats names and values of files that may be of strangers.
    """
    lines = (
        "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in _short(line))
        for line in text.split("\n")
    )
    return "\n".join(lines)


def _short(line: str) -> str:
    half = LONGEST_LINE // 2
    return line if len(line) <= LONGEST_LINE else f"{line[:half]} ... {line[-half:]}"


def listen() -> None:
    """From now on Ctrl-C, SIGTERM and SIGHUP raise `Stopped`; those that the caller has us ignore stay ignored."""
    sys.unraisablehook = _raise_again
    for name in SIGNALS:
        number = getattr(signal, name)
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)


def listen_no_more() -> None:
    """The end of `listen`: what is left to do loses nothing."""
    for name in SIGNALS:
        if signal.getsignal(getattr(signal, name)) is not signal.SIG_IGN:
            signal.signal(getattr(signal, name), signal.SIG_DFL)


def say_stopped(number: int) -> int:
    """Tell on stderr that a signal ended the program and how to go on; the exit code."""
    os.write(2, f"\nstopped by {signal.Signals(number).name}; to go on, run again: {own_command()}\n".encode())
    return BY_SIGNAL + number


def _stop(number: int, frame: FrameType | None) -> None:
    """Unwind, so that temporary files and locks are removed; a second signal, or time, ends the process at once."""
    for name in SIGNALS:
        signal.signal(getattr(signal, name), _leave)
    threading.Thread(target=_leave_late, args=(number,), daemon=True).start()
    raise Stopped(number)


def _raise_again(lost: sys.UnraisableHookArgs) -> None:
    """A signal that comes while the interpreter calls a destructor cannot be raised from there: it comes once more."""
    if not isinstance(lost.exc_value, Stopped):
        sys.__unraisablehook__(lost)
        return
    listen()
    threading.Timer(AGAIN_S, os.kill, (os.getpid(), lost.exc_value.number)).start()


def _leave(number: int, frame: FrameType | None = None) -> None:
    os._exit(say_stopped(number))


def _leave_late(number: int) -> None:
    time.sleep(PATIENCE_S)
    _leave(number)


def say_unexpected(error: BaseException) -> int:
    """Tell in one sentence of an error that nobody expected, with its traceback in a file; the exit code."""
    what = printable(" ".join(f"{type(error).__name__}: {error}".split())[:300])
    try:
        descriptor, name = tempfile.mkstemp(prefix="pipelines-", suffix=".log")
        with os.fdopen(descriptor, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(f"{own_command()}\n\n")
            traceback.print_exception(error, file=file)
        where = f"where it happened is in {name}"
    except OSError as other:
        where = f"where it happened could not be kept ({other.strerror}): {_place(error)}"
    print(
        f"error: something that nobody expected ({what}); {where}, which whoever maintains this needs", file=sys.stderr
    )
    return UNEXPECTED


def _place(error: BaseException) -> str:
    last = traceback.extract_tb(error.__traceback__)[-1:]
    return ", ".join(f"{Path(item.filename).name}, line {item.lineno}" for item in last) or "unknown"
