"""Errors that a user can mend: one sentence that says what was given, what is allowed and what to do."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class UserError(ValueError):
    """Wrong input; the command line prints the message and exits with 2."""


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """` (did you mean 'demo'?)`, to stand behind an unknown name; nothing if no known name is close to it."""
    close = difflib.get_close_matches(given, list(known), n=1)
    return f" (did you mean {close[0]!r}?)" if close else ""
