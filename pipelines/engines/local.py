"""The engine of one machine: this process, or several beside it."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass

from datasets.errors import UserError
from pipelines.engines.engine import Result, Task, check_workers


@dataclass(frozen=True, slots=True)
class LocalEngine:
    """Tasks run in this process, or in `workers` processes of this machine.

    Raises:
        UserError: a number of workers that is not usable.
    """

    workers: int = 1

    def __post_init__(self) -> None:
        check_workers(self.workers)

    def runs_here(self, tasks: Sequence[object]) -> bool:
        """Whether `map` would run these tasks in this process."""
        return self.workers == 1 or len(tasks) < 2

    def map(self, run_one: Callable[[Task], Result], tasks: Sequence[Task]) -> Iterator[tuple[Task, Result]]:
        """Run every task, and yield each with its result when it is done, in any order.

        Raises:
            UserError: a worker that the system killed.
            Exception: what a task raised; tasks not yet begun are cancelled.
        """
        if self.runs_here(tasks):
            for task in tasks:
                yield task, run_one(task)
            return
        # Mitsuba starts threads, which a forked process would not have: processes are spawned.
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(min(self.workers, len(tasks)), mp_context=context) as pool:
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
