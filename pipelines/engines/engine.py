"""What an engine is: it maps a function over shards. The function does all the work; an engine only decides where."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Protocol, TypeVar

from datasets.errors import UserError

MAX_WORKERS = 256
Task = TypeVar("Task")
Result = TypeVar("Result")


class Engine(Protocol):
    """A place where tasks run."""

    def runs_here(self, tasks: Sequence[object]) -> bool:
        """Whether `map` would run these tasks in this process, so that they can tell of their progress."""
        ...

    def map(self, run_one: Callable[[Task], Result], tasks: Sequence[Task]) -> Iterator[tuple[Task, Result]]:
        """Run every task at least once, and yield each with its result when it is done, in any order.

        A task may be run again where another machine was lost while it ran, so doing it twice must do no harm.

        Raises:
            UserError: a process that the system killed, or an engine that cannot be reached.
            Exception: what a task raised; tasks not yet begun are cancelled.
        """
        ...


def check_workers(workers: int) -> None:
    """Refuse a number of workers that is not usable.

    Raises:
        UserError: below 1 or above MAX_WORKERS.
    """
    if not 1 <= workers <= MAX_WORKERS:
        raise UserError(f"{workers} workers are not usable; give --workers from 1 to {MAX_WORKERS}")
