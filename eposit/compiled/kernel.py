"""Functions that become machine code: plain Python of numbers, loops and one or more arrays of numbers.

`translate` has the rules; a function's types are in its decorator. `machine_code.native` is what Python calls: nothing
is translated before, and then only what that one function needs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

NUMBER, WHOLE, TRUTH, POINTER, NOTHING = "double", "i64", "i1", "ptr", "void"
LANES = 4
NUMBERS, TRUTHS = "<4 x double>", "<4 x i1>"  # one in each lane: an operation is done on all of them at once
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
    suffix: str = ""  # tells types of one function apart

    @property
    def name(self) -> str:
        """With its module, unique in a program."""
        return f"{self.function.__module__}.{self.function.__name__}{self.suffix}"


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


def four_at_once(kernel: Any) -> Any:
    """The same function for four numbers side by side wherever it has one."""

    def in_fours(kind: str) -> str:
        return NUMBERS if kind == NUMBER else kind

    returns = in_fours(kernel.returns) if isinstance(kernel.returns, str) else tuple(map(in_fours, kernel.returns))
    return replace(kernel, returns=returns, arguments=tuple(map(in_fours, kernel.arguments)), suffix=" of four")


def four(a: float, b: float, c: float, d: float) -> Any:
    """Four numbers side by side."""
    return np.array((a, b, c, d))


@part(NUMBER, NUMBERS)
def total(values):
    """The sum of four numbers side by side."""
    return (values[0] + values[1]) + (values[2] + values[3])
