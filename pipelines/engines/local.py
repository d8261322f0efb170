"""The engine of one machine: this process, or several beside it."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

from pipelines.engines.engine import FATAL, TRIES, Failure, Result, Task, check_workers
from pipelines.engines.pool import run_in_processes


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

    def map(
        self,
        run_one: Callable[[Task], Result],
        tasks: Sequence[Task],
        failed: Callable[[Task, Failure], None] | None = None,
    ) -> Iterator[tuple[Task, Result]]:
        """Run every task, and yield each with its result when it is done, in any order; as `Engine.map`."""
        if self.runs_here(tasks):
            outcomes = (_tried(run_one, task) for task in tasks)
        else:
            outcomes = run_in_processes(run_one, tasks, min(self.workers, len(tasks)))
        with closing(outcomes):
            for task, result, failure in outcomes:
                if failure is None:
                    yield task, result
                elif failed is not None:
                    failed(task, failure)
                else:
                    raise failure.error


def _tried(run_one: Callable[[Task], Result], task: Task) -> tuple[Task, Any, Failure | None]:
    """Run a task in this process, and once more if it fails."""
    failure = None
    for _ in range(TRIES):
        try:
            return task, run_one(task), None
        except FATAL:
            raise
        except Exception as error:
            failure = Failure(error, traceback.format_exc())
    return task, None, failure
