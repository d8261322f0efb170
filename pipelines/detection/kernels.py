"""How the detection's small loops are compiled: three decorators, and why none lets the compiler reorder arithmetic.

With that freedom (`fastmath`), the last digits depend on how Numba numbers its variables and blocks, and so on which
functions a process has compiled before: a run with an empty cache, a resumed one and a worker would differ. As written,
sums and products give the same bits from every copy of a function, whatever was compiled before it.

Loops are written out in these functions: NumPy's expressions, slices and linear algebra take seconds to compile.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

import numba

from pipelines.detection.kernel_cache import choose_folder, numba_keeps_in

Function = TypeVar("Function", bound=Callable[..., Any])
_folder = cache(choose_folder)


def compiled(function: Function) -> Function:
    """For Python and for other compiled functions."""
    return _kept(function)


def compiled_part(function: Function) -> Function:
    """For other compiled functions only."""
    return _kept(function, no_cpython_wrapper=True)


def inlined(function: Function) -> Function:
    """Part of each compiled function that calls it."""
    jit: Any = numba.njit
    return jit(inline="always")(function)


def _kept(function: Any, **options: Any) -> Any:
    """Compiled, and kept for later runs where a folder can be written."""
    options |= {"no_cfunc_wrapper": True, "error_model": "numpy"}  # a wrapper that nobody calls takes time to compile
    jit: Any = numba.njit
    folder = _folder()
    if folder is None:
        return jit(**options)(function)
    with numba_keeps_in(folder):
        return jit(cache=True, **options)(function)
