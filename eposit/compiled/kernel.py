"""Functions that become machine code: plain Python of numbers, loops and one or more arrays of numbers.

`translate` has the rules; a function's types are in its decorator. `machine_code.native` is what Python calls: nothing
is translated before, and then only what that one function needs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

NUMBER, WHOLE, TRUTH, POINTER, NOTHING = "double", "i64", "i1", "ptr", "void"
W = POINTER  # the workspace
Returns = str | tuple[str, ...]
F = TypeVar("F", bound=Callable[..., Any])


@dataclass(frozen=True, eq=False)
class Kernel:
    """One function with its types."""

    function: Callable[..., Any]
    returns: Returns  # a type, or several
    arguments: tuple[str, ...]
    inline: bool  # whether it becomes part of those that call it

    @property
    def name(self) -> str:
        """With its module, unique in a program."""
        return f"{self.function.__module__}.{self.function.__name__}"


def compiled(returns: Returns, *arguments: str) -> Callable[[F], F]:
    """A function for others in this package, and for Python."""

    def decorate(function: F) -> F:
        made: Any = Kernel(function, returns, arguments, inline=False)
        return made

    return decorate


def part(returns: Returns, *arguments: str) -> Callable[[F], F]:
    """A short function that becomes part of those that call it."""

    def decorate(function: F) -> F:
        made: Any = Kernel(function, returns, arguments, inline=True)
        return made

    return decorate
