"""Work that follows rendering, done in threads while the next frame is rendered."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

THREADS = 2  # compression, blur and waiting for the disk leave Python's lock alone
IN_FLIGHT = 4  # frames that are rendered and not yet finished: bounds the memory

Row = TypeVar("Row")


def overlapped(makers: Iterable[Callable[[], Row]], advance: Callable[[], None] = lambda: None) -> Iterator[Row]:
    """What the makers return, in their order: they run in threads while the iterable makes the next one.

    advance: called for each row.
    Raises:
        Exception: what the iterable or a maker raised, after the makers that had begun have ended.
    """
    begun: deque[Future[Row]] = deque()
    with ThreadPoolExecutor(THREADS) as pool:
        try:
            for maker in makers:
                begun.append(pool.submit(maker))
                while len(begun) >= IN_FLIGHT or (begun and begun[0].done()):
                    yield _next(begun, advance)
            while begun:
                yield _next(begun, advance)
        finally:
            for future in begun:
                future.cancel()


def _next(begun: deque[Future[Row]], advance: Callable[[], None]) -> Row:
    row = begun.popleft().result()
    advance()
    return row
