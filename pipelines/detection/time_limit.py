"""The last limit on what the detection of one picture may take; bounds on its work end every picture long before.

It is processor time of the thread that detects: what else the machine does hardly changes it. It is looked at between
steps. One call of OpenCV cannot be ended, but is given bounded work.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

DETECT_SECONDS = 2.0
MOST_DETECT_SECONDS = 86_400.0
Check = Callable[[], None]  # called between steps; it raises TooLateError


class TooLateError(Exception):
    """The detection of a picture has taken longer than it may."""


def unlimited() -> None:
    """A check that never ends anything."""


def _now() -> float:
    return time.thread_time()


@dataclass(frozen=True, slots=True)
class TimeLimit:
    """Seconds of processor time from now on, in this thread."""

    seconds: float
    begin: float = field(default_factory=_now)

    def check(self) -> None:
        """Raises:
        TooLateError: they are over.
        """
        if _now() - self.begin > self.seconds:
            raise TooLateError
