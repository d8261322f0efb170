"""Times of calls that are made in turn, so that a busy machine is equally busy for all of them.

Neither `timeit` nor `pyperf` measures so: both repeat one call until it is done and then the next, and pyperf does each
in a process of its own, where every kernel and every scene would be compiled anew. Neither gives the time of the
processor beside that of the clock, which is what a machine that others use can be judged by.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

REPEATS = 3
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Times:
    """Seconds of one call."""

    wall: float  # median
    cpu: float  # least time of the processor, all threads of this process together

    def __add__(self, other: Times) -> Times:
        return Times(self.wall + other.wall, self.cpu + other.cpu)

    def __truediv__(self, count: int) -> Times:
        return Times(self.wall / count, self.cpu / count)


def timed(call: Callable[[], T]) -> tuple[T, Times]:
    """What a call returns, and its times."""
    wall, cpu = time.perf_counter(), time.process_time()
    result = call()
    return result, Times(time.perf_counter() - wall, time.process_time() - cpu)


def in_turn(*calls: Callable[[], object], repeats: int = REPEATS, warm_up: bool = True) -> list[Times]:
    """Times of each call, made A B A B after one round that does not count.

    A call that returns `Times` has timed itself.
    """
    if warm_up:
        for call in calls:
            call()
    measured: list[list[Times]] = [[] for _ in calls]
    for _ in range(repeats):
        for call, found in zip(calls, measured, strict=True):
            result, times = timed(call)
            found.append(result if isinstance(result, Times) else times)
    return [summary(found) for found in measured]


def summary(times: Sequence[Times]) -> Times:
    """The times of one call from those of several like it."""
    return Times(statistics.median(one.wall for one in times), min(one.cpu for one in times))


def mean_of(call: Callable[[], object], count: int) -> Times:
    """Times of one of `count` calls in a row, for a call that is far shorter than what it is compared with."""

    def all_of_them() -> None:
        for _ in range(count):
            call()

    return timed(all_of_them)[1] / count


def total(times: list[Times]) -> Times:
    """The sum of several."""
    return sum(times, Times(0.0, 0.0))
