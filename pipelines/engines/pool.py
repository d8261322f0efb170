"""Worker processes of this machine, of which any may crash: its task is done once more by a new one."""

from __future__ import annotations

import multiprocessing
import signal
import sys
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any

from datasets.errors import UserError
from pipelines.engines.engine import FATAL, TRIES, Failure
from pipelines.engines.worker import serve

HELD_BACK = tuple(getattr(signal, name) for name in ("SIGINT", "SIGHUP", "SIGTERM") if hasattr(signal, name))
PATIENCE_S = 5.0  # within which a process that was killed ends


class LostProcessError(UserError):
    """A worker process that ended while it worked."""


@dataclass
class _Worker:
    process: SpawnProcess
    pipe: Connection
    numbered: tuple[int, Any] = (0, None)  # the task with its number
    is_busy: bool = False


def run_in_processes(
    run_one: Callable[[Any], Any], tasks: Sequence[Any], count: int
) -> Iterator[tuple[Any, Any, Failure | None]]:
    """Each task with its result, or with why it failed twice, in any order.

    Raises:
        FATAL: of a task; nothing else is begun then.
    """
    waiting, tries = deque(enumerate(tasks)), [0] * len(tasks)
    workers: list[_Worker] = []
    try:
        while waiting or any(worker.is_busy for worker in workers):
            _hand_out(waiting, workers, run_one, count)
            for worker in _ready(workers):
                number, task = worker.numbered
                result, error, trace = _received(worker, workers)
                if isinstance(error, FATAL) and not isinstance(error, LostProcessError):
                    raise error
                if error is None:
                    yield task, result, None
                    continue
                tries[number] += 1
                if tries[number] < TRIES:
                    waiting.appendleft((number, task))
                else:
                    yield task, None, Failure(error, trace)
    finally:
        for worker in workers:
            _end(worker)


def _hand_out(
    waiting: deque[tuple[int, Any]], workers: list[_Worker], run_one: Callable[[Any], Any], count: int
) -> None:
    """Give every idle worker a task, starting those that are missing."""
    while waiting:
        worker = next((worker for worker in workers if not worker.is_busy), None)
        if worker is None:
            if len(workers) == count:
                return
            worker = _start(run_one)
            workers.append(worker)
        worker.numbered, worker.is_busy = waiting.popleft(), True
        with suppress(OSError):  # it has ended: whoever waits for it notices
            worker.pipe.send(worker.numbered[1])


def _start(run_one: Callable[[Any], Any]) -> _Worker:
    # Mitsuba starts threads, which a forked process would not have: processes are spawned.
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    process = context.Process(target=serve, args=(theirs, run_one))
    with _signals_held_back():
        process.start()
    theirs.close()
    return _Worker(process, ours)


@contextmanager
def _signals_held_back() -> Iterator[None]:
    """A process that is started in the body never gets the signals of a terminal: its parent does, and ends it."""
    if sys.platform == "win32":
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, HELD_BACK)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _ready(workers: list[_Worker]) -> list[_Worker]:
    """Busy workers that have sent something or have ended; at least one."""
    busy = [worker for worker in workers if worker.is_busy]
    found = wait([item for worker in busy for item in (worker.pipe, worker.process.sentinel)])
    return [worker for worker in busy if worker.pipe in found or worker.process.sentinel in found]


def _received(worker: _Worker, workers: list[_Worker]) -> tuple[Any, BaseException | None, str]:
    """What a worker sends of its task; of one that has ended, how. That one is no longer among the workers."""
    worker.is_busy = False
    try:
        if worker.pipe.poll():
            return worker.pipe.recv()
    except (EOFError, OSError):
        pass
    workers.remove(worker)
    _end(worker)
    return None, LostProcessError(_told(worker.process.exitcode)), ""


def _told(code: int | None) -> str:
    """How a process ended, and what to do."""
    if code is None or code >= 0:
        return f"a worker process ended with exit code {code}; run the same command again to go on"
    name = signal.Signals(-code).name if -code in list(signal.Signals) else f"signal {-code}"
    if name == "SIGKILL":
        return "a worker process was killed, often for lack of memory; run again with fewer --workers"
    return f"a worker process was ended by {name}; run the same command again to go on"


def _end(worker: _Worker) -> None:
    """End a worker: what it was doing is done again, or not wanted."""
    worker.pipe.close()
    worker.process.kill()
    worker.process.join(PATIENCE_S)
