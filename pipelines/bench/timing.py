"""Times of calls that are made in turn, so that a busy machine is equally busy for all of them."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

REPEATS = 3


@dataclass(frozen=True, slots=True)
class Times:
    """Seconds of one call."""

    wall: float  # median
    cpu: float  # least time of the processor, all threads of this process together

    def __add__(self, other: Times) -> Times:
        return Times(self.wall + other.wall, self.cpu + other.cpu)


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
            wall, cpu = time.perf_counter(), time.process_time()
            own = call()
            taken = Times(time.perf_counter() - wall, time.process_time() - cpu)
            found.append(own if isinstance(own, Times) else taken)
    return [Times(statistics.median(t.wall for t in found), min(t.cpu for t in found)) for found in measured]


def mean_of(call: Callable[[], object], count: int) -> Times:
    """Times of one of `count` calls in a row, for a call that is far shorter than what it is compared with."""
    wall, cpu = time.perf_counter(), time.process_time()
    for _ in range(count):
        call()
    return Times((time.perf_counter() - wall) / count, (time.process_time() - cpu) / count)


def total(times: list[Times]) -> Times:
    """The sum of several."""
    return sum(times, Times(0.0, 0.0))
