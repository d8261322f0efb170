"""How functions are compiled here.

Every function of some length is compiled once, for itself, and called by its address: Numba would compile it again,
with all that it calls, for every function above it. Without fast mathematics: the last bits of a result must not
depend on what the compiler could rearrange. With NUMBA_DISABLE_JIT=1 all of it is plain Python.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba
from llvmlite import binding
from numba.core import config, types

from eposit.compiled.cache import choose_folder, numba_keeps_in

F = TypeVar("F", bound=Callable[..., Any])
W, WHOLE, NUMBER, NOTHING = types.CPointer(types.float64), types.int64, types.float64, types.void
PLAIN_PYTHON = bool(config.DISABLE_JIT)  # pyright: ignore


@cache
def _folder() -> Path | None:
    return choose_folder(Path(__file__).parent)


def _kept() -> AbstractContextManager[None]:
    folder = _folder()
    return nullcontext() if folder is None else numba_keeps_in(folder)


def part(function: F) -> F:
    """A short function that becomes part of those that call it; a division by zero gives infinity, as in NumPy."""
    return numba.njit(error_model="numpy", nogil=True)(function)  # pyright: ignore


def compiled(returns: Any, *arguments: Any) -> Callable[[F], F]:
    """A function of the workspace, whole numbers and numbers, for others in this package."""

    def decorate(function: F) -> F:
        if PLAIN_PYTHON:
            return function
        signature = returns(*arguments)
        with _kept():
            made: Any = numba.cfunc(signature, error_model="numpy", cache=_folder() is not None)(function)
        name = f"{function.__module__}.{function.__name__}"
        binding.add_symbol(name, made.address)
        symbol: Any = types.ExternalFunction(name, signature)
        symbol.made = made  # the machine code lives as long as this
        return symbol

    return decorate


def entry(signature: str) -> Callable[[F], F]:
    """A function that Python calls."""

    def decorate(function: F) -> F:
        with _kept():
            options = {"error_model": "numpy", "nogil": True, "cache": _folder() is not None}
            return numba.njit(signature, **options)(function)  # pyright: ignore

    return decorate


def pointer(w: Any) -> Any:
    """The workspace as `compiled` functions take it, in an `entry`."""
    return w


if not PLAIN_PYTHON:
    pointer = part(lambda w: w.ctypes)
