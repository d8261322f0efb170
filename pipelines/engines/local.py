"""Engines map a stage's function over shards. The function does all the work; an engine only decides where."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import TypeVar

from datasets.errors import UserError

MAX_WORKERS = 256
Task = TypeVar("Task")
Result = TypeVar("Result")


def check_workers(workers: int) -> None:
    """Refuse a number of workers that is not usable.

    Raises:
        UserError: below 1 or above MAX_WORKERS.
    """
    if not 1 <= workers <= MAX_WORKERS:
        raise UserError(f"{workers} workers are not usable; give --workers from 1 to {MAX_WORKERS}")


def runs_here(tasks: Sequence[Task], workers: int) -> bool:
    """Whether `map_shards` would run these tasks in this process."""
    return workers == 1 or len(tasks) < 2


def map_shards(run_one: Callable[[Task], Result], tasks: Sequence[Task], workers: int) -> Iterator[tuple[Task, Result]]:
    """Run every task, here or in `workers` processes, and yield each with its result when it is done, in any order.

    Raises:
        UserError: a number of workers that is not usable, or a worker that the system killed.
        Exception: what a task raised; tasks not yet begun are cancelled.
    """
    check_workers(workers)
    if runs_here(tasks, workers):
        for task in tasks:
            yield task, run_one(task)
        return
    # Mitsuba starts threads, which a forked process would not have: processes are spawned.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(workers, len(tasks)), mp_context=context) as pool:
        futures = {pool.submit(run_one, task): task for task in tasks}
        try:
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BrokenProcessPool:
            raise UserError(
                "a worker process was killed, often for lack of memory; run again with fewer --workers"
            ) from None
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
