"""Libraries that print what they raise: nobody could tell their lines from ours."""

from __future__ import annotations

import io
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout

_ONE_AT_A_TIME = threading.Lock()  # of two threads the second would keep the first one's silence for the real stderr


@contextmanager
def silent_library() -> Iterator[None]:
    """Nothing is printed: OpenEXR and libpng write what they raise to descriptor 2, OpenEXR's binding to sys.stdout."""
    with _ONE_AT_A_TIME:
        kept = os.dup(2)
        try:
            with open(os.devnull, "wb") as nowhere:
                os.dup2(nowhere.fileno(), 2)
            with redirect_stdout(io.StringIO()):
                yield
        finally:
            os.dup2(kept, 2)
            os.close(kept)
