"""Where a night works: a folder of its own beside the history, which goes with it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from datasets.errors import UserError
from datasets.store.atomic import own_name
from datasets.store.lock import HeldError, hold

PREFIX = ".work-"


@contextmanager
def work_folder(history: Path) -> Iterator[Path]:
    """A folder of this night alone; those that killed nights of this machine left are removed.

    Raises:
        UserError: the disk or its permissions refuse.
    """
    for folder in history.glob(f"{PREFIX}*"):
        try:
            with hold(folder):
                shutil.rmtree(folder, ignore_errors=True)
        except (HeldError, OSError):
            pass
    work = history / own_name(PREFIX)
    try:
        work.mkdir(parents=True)
    except OSError as error:
        raise UserError(f"cannot write {work}: {error.strerror}; choose another --history") from error
    with hold(work):
        try:
            yield work
        finally:
            shutil.rmtree(work, ignore_errors=True)
