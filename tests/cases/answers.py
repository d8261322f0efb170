"""One case and what is said of it now."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Case:
    """A row of the table."""

    name: str  # file in the folder
    what: str
    before: str
    now: str
    right: str


def said_by(ask: Callable[[], str]) -> str:
    """What a function says, or the exception that it ends with, or that its file is not there."""
    try:
        return ask()
    except FileNotFoundError:
        return "file not in the folder"
    except Exception as error:  # any failure is what this case says
        return f"{type(error).__name__}: {str(error).splitlines()[0] if str(error) else ''}"
