"""Worker processes of this machine, of which any may crash: its task is done once more by a new one."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import wait
from typing import Any

from datasets.errors import UserError
from pipelines.children import Child, start
from pipelines.engines.engine import FATAL, TRIES, Failure
from pipelines.engines.worker import serve


class LostProcessError(UserError):
    """A worker process that ended while it worked."""


@dataclass
class _Worker:
    child: Child
    numbered: tuple[int, Any] = (0, None)  # the task with its number
    is_busy: bool = False


def run_in_processes(
    run_one: Callable[[Any], Any], tasks: Sequence[Any], count: int
) -> Generator[tuple[Any, Any, Failure | None], None, None]:
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
            worker.child.kill()


def _hand_out(
    waiting: deque[tuple[int, Any]], workers: list[_Worker], run_one: Callable[[Any], Any], count: int
) -> None:
    """Give every idle worker a task, starting those that are missing."""
    while waiting:
        worker = next((worker for worker in workers if not worker.is_busy), None)
        if worker is None:
            if len(workers) == count:
                return
            worker = _Worker(start(serve, run_one))
            workers.append(worker)
        worker.numbered, worker.is_busy = waiting.popleft(), True
        with suppress(OSError):  # it has ended: whoever waits for it notices
            worker.child.pipe.send(worker.numbered[1])


def _ready(workers: list[_Worker]) -> list[_Worker]:
    """Busy workers that have sent something or have ended; at least one."""
    busy = [worker for worker in workers if worker.is_busy]
    found = wait([item for worker in busy for item in (worker.child.pipe, worker.child.process.sentinel)])
    return [worker for worker in busy if worker.child.pipe in found or worker.child.process.sentinel in found]


def _received(worker: _Worker, workers: list[_Worker]) -> tuple[Any, BaseException | None, str]:
    """What a worker sends of its task; of one that has ended, how. That one is no longer among the workers."""
    worker.is_busy = False
    try:
        if worker.child.pipe.poll():
            return worker.child.pipe.recv()
    except (EOFError, OSError):
        pass
    workers.remove(worker)
    told, advice = worker.child.end, "run the same command again to go on"
    if told == "was killed":
        told, advice = f"{told}, often for lack of memory", "run again with fewer --workers"
    worker.child.kill()
    return None, LostProcessError(f"a worker process {told}; {advice}"), ""
