"""What an engine is: it maps a function over shards. The function does all the work; an engine only decides where."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol, TypeVar

from datasets.errors import UserError
from datasets.url_path import UnreachableError
from render.backend import BackendError

MAX_WORKERS = 256
TRIES = 2  # of a task that fails in a way that nobody expected
FATAL = (UserError, BackendError, UnreachableError, OSError)  # what every task would fail with
Task = TypeVar("Task")
Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Failure:
    """Why a task failed each time that it was tried."""

    error: BaseException  # as it was raised, or what ended the task's process
    trace: str = ""  # of the exception; nothing of a process that ended

    @property
    def reason(self) -> str:
        """The error in one line."""
        text = " ".join(str(self.error).split())
        return text if isinstance(self.error, UserError) else f"{type(self.error).__name__}: {text}"


class Engine(Protocol):
    """A place where tasks run."""

    def runs_here(self, tasks: Sequence[object]) -> bool:
        """Whether `map` would run these tasks in this process, so that they can tell of their progress."""
        ...

    def map(
        self,
        run_one: Callable[[Task], Result],
        tasks: Sequence[Task],
        failed: Callable[[Task, Failure], None] | None = None,
    ) -> Iterator[tuple[Task, Result]]:
        """Run every task at least once, and yield each with its result when it is done, in any order.

        A task may be run again where it failed or its process was lost, so doing it twice must do no harm.

        failed: called for a task that has failed `TRIES` times, and is then left out. Without it such a task ends all.

        Raises:
            UserError: what a task raised so, or an engine that cannot be reached; tasks not yet begun are cancelled.
            Exception: what a task raised, without `failed`.
        """
        ...


def check_workers(workers: int) -> None:
    """Refuse a number of workers that is not usable.

    Raises:
        UserError: below 1 or above MAX_WORKERS.
    """
    if not 1 <= workers <= MAX_WORKERS:
        raise UserError(f"{workers} workers are not usable; give --workers from 1 to {MAX_WORKERS}")
