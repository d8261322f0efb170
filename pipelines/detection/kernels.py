"""How the detection's small loops are compiled: three decorators, and why none lets the compiler reorder arithmetic.

With that freedom (`fastmath`), the last digits depend on how Numba numbers its variables and blocks, and so on which
functions a process has compiled before: a run with an empty cache, a resumed one and a worker would differ. As written,
sums and products give the same bits from every copy of a function, whatever was compiled before it.

Loops are written out in these functions: NumPy's expressions, slices and linear algebra take seconds to compile.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba
from numba.core import config

Function = TypeVar("Function", bound=Callable[..., Any])


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
    """Compiled, and kept for later runs: beside the source, else in the user's own cache, else in a folder of this user
    among the temporary files, else not at all."""
    options |= {"no_cfunc_wrapper": True, "error_model": "numpy"}  # a wrapper that nobody calls takes time to compile
    jit: Any = numba.njit
    try:
        return jit(cache=True, **options)(function)
    except RuntimeError:  # Numba can write neither beside the source nor in the user's cache
        folder = own_temporary_folder()
        if folder is None:
            return jit(**options)(function)
        config.CACHE_DIR = str(folder)  # pyright: ignore[reportAttributeAccessIssue]
        return jit(cache=True, **options)(function)


def own_temporary_folder() -> Path | None:
    """A folder among the temporary files that only this user can write; None if somebody else has it."""
    folder = Path(tempfile.gettempdir()) / f"eposit-kernels-{os.getuid() if hasattr(os, 'getuid') else 'own'}"
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.stat()
    except OSError:
        return None
    mine = not hasattr(os, "getuid") or (found.st_uid == os.getuid() and found.st_mode & 0o077 == 0)
    return folder if mine and not folder.is_symlink() else None
