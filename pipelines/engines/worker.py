"""What a worker process does: one task after the other, until its pipe closes."""

from __future__ import annotations

import pickle
import traceback
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import Any

from pipelines.children import OTHER_END_GONE


def serve(pipe: Connection, run_one: Callable[[Any], Any]) -> None:
    """Receive tasks; send back (result, None, "") of each, or (None, exception, traceback)."""
    with suppress(*OTHER_END_GONE):
        while True:
            pipe.send(_outcome(run_one, pipe.recv()))


def _outcome(run_one: Callable[[Any], Any], task: Any) -> tuple[Any, BaseException | None, str]:
    try:
        return run_one(task), None, ""
    except Exception as error:
        return None, _picklable(error), traceback.format_exc()


def _picklable(error: Exception) -> Exception:
    """The error itself, or what it says where it cannot go through a pipe."""
    try:
        pickle.loads(pickle.dumps(error))
    except Exception:
        return RuntimeError(f"{type(error).__name__}: {error}")
    return error
