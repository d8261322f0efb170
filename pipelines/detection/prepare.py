"""Detection's compiled functions, compiled or loaded before the first picture, beside other work."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from threading import Event
from types import TracebackType
from typing import Any

from numba.core import event

from pipelines.detection import (
    circle_model,
    circle_patch,
    circle_pixels,
    corner_likeness,
    corner_model,
    generic_lens,
    grid_steps,
    levels,
    saddle_links,
    saddle_peaks,
    saddles,
    sampling,
)

MODULES = (  # those with compiled functions; the slowest first
    corner_model, generic_lens, circle_model, saddle_links, saddle_peaks, saddles, corner_likeness,
    circle_patch, circle_pixels, grid_steps, levels, sampling,
)  # fmt: skip


def compile_kernels(
    on_compile: Callable[[], None] = lambda: None, is_stopped: Callable[[], bool] = lambda: False
) -> None:
    """Call each compiled function once, on next to nothing.

    It takes seconds on a machine that has not kept them yet, and a tenth of one where it has.

    on_compile: called for each function that was not kept. is_stopped: asked before each module; true ends the work.
    """
    listener: Any = _OnStart(on_compile)
    with event.install_listener("numba:compile", listener):
        for module in MODULES:
            if is_stopped():
                return
            module.prepare()


class Kernels:
    """The compiled functions, made ready in a thread from when the context is entered.

    On leaving it, what has not begun is left out.
    """

    def __init__(self) -> None:
        self._stop = Event()
        self._first: Future[None] = Future()  # done when the first function turns out not to have been kept

    def __enter__(self) -> Kernels:
        self._pool = ThreadPoolExecutor(1)
        self._all = self._pool.submit(compile_kernels, self._note, self._stop.is_set)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        self._pool.shutdown()

    def must_compile(self) -> bool:
        """Whether functions are being compiled; it waits until that is known, and is false once all are ready."""
        wait((self._first, self._all), return_when=FIRST_COMPLETED)
        return not self._all.done()

    def finish(self) -> None:
        """Wait until all are ready.

        Raises:
            Exception: what the compiler raised.
        """
        self._all.result()

    def _note(self) -> None:
        if not self._first.done():
            self._first.set_result(None)


class _OnStart(event.Listener):
    """Calls a function at the start of each event."""

    def __init__(self, call: Callable[[], None]) -> None:
        self._call = call

    def on_start(self, event: Any) -> None:
        self._call()

    def on_end(self, event: Any) -> None:
        pass
