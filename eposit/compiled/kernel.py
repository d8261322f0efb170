"""Functions that become machine code: plain Python of numbers, loops and one or more arrays of numbers.

`translate` has the rules; a function's types are in its decorator. Nothing is translated before a function is called
from Python for the first time, and then only what that one needs.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable
from typing import Any, TypeVar

NUMBER, WHOLE, TRUTH, POINTER, NOTHING = "double", "i64", "i1", "ptr", "void"
W = POINTER  # the workspace
Returns = str | tuple[str, ...]
C_TYPES = {NUMBER: ctypes.c_double, WHOLE: ctypes.c_int64, POINTER: ctypes.c_void_p, NOTHING: None}
F = TypeVar("F", bound=Callable[..., Any])


class Kernel:
    """One function with its types; several numbers may be returned, but not to Python."""

    def __init__(self, function: Callable[..., Any], returns: Returns, arguments: tuple[str, ...], inline: bool):
        self.function, self.returns, self.arguments, self.inline = function, returns, arguments, inline
        self.name = f"{function.__module__}.{function.__name__}"
        self.__doc__ = function.__doc__
        self._lock, self._code, self._call = threading.Lock(), None, None

    def __call__(self, *arguments: Any) -> Any:
        """Call the machine code; arrays are given by their address."""
        return (self._call or self._load())(*arguments)

    def _load(self) -> Callable[..., Any]:
        from eposit.compiled.machine_code import MachineCode

        with self._lock:
            if self._call is None:
                assert isinstance(self.returns, str)
                self._code = MachineCode(self)  # lives as long as this
                prototype = ctypes.CFUNCTYPE(C_TYPES[self.returns], *(C_TYPES[name] for name in self.arguments))
                self._call = prototype(self._code.address)
            return self._call


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
