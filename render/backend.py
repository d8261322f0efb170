"""The one door to Mitsuba and Dr.Jit: finds a usable LLVM or GPU and fixes the variant.

Dr.Jit compiles its kernels with an LLVM library that it loads at run time. Versions below 19 abort the whole process
at the first `maximum` ("Cannot select: fmaximum"), so the library is found and checked before Dr.Jit is imported.
"""

from __future__ import annotations

import ctypes
import ctypes.util
import functools
import os
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

MINIMUM_LLVM = 19
CPU_VARIANT = "llvm_ad_rgb"
CUDA_VARIANT = "cuda_ad_rgb"
VARIANTS = (CPU_VARIANT, CUDA_VARIANT)
SYSTEM_FOLDERS = (  # below /, with wildcards
    "usr/lib", "usr/local/lib", "opt/homebrew/opt/llvm/lib", "usr/lib/*-linux-gnu*", "usr/lib/llvm-*/lib",
)  # fmt: skip
LIBRARY_VARIABLE = "DRJIT_LIBLLVM_PATH"
ALIGNMENT = 64  # bytes, of the device's memory
ADVICE = (
    f"install one with `pip install karellen-llvm-core`, or set {LIBRARY_VARIABLE} to libLLVM {MINIMUM_LLVM} or later"
)


class BackendError(RuntimeError):
    """No usable compiler back end; the message is one sentence with the remedy."""


def llvm_version(library: Path) -> int | None:
    """Major version that an LLVM shared library reports; None for a library that is not LLVM.

    Raises:
        OSError: the library cannot be loaded: it is damaged, or a library that it needs is missing.
    """
    handle = ctypes.CDLL(str(library))
    try:
        major = ctypes.c_uint()
        handle.LLVMGetVersion(ctypes.byref(major), None, None)
        return int(major.value)
    except AttributeError:  # LLVM states its version since 16
        return _version_in_name(library)


def find_llvm() -> Path:
    """The LLVM library to use: the one the user names, the PyPI wheel's, then the newest of the system.

    Raises:
        BackendError: the named one is missing, too old or cannot be loaded, or no usable one is found.
    """
    named = os.environ.get(LIBRARY_VARIABLE)
    if named:
        problem = _problem_of(Path(named))
        if problem:
            raise BackendError(f"{LIBRARY_VARIABLE} names {named!r}, which {problem}; {ADVICE}")
        return Path(named)
    refused: list[str] = []
    for library in _candidates():
        problem = _problem_of(library)
        if problem is None:
            return library
        refused.append(f"{library.name}, which {problem}")
    found = f"found only {'; '.join(dict.fromkeys(refused))}" if refused else "found none"
    raise BackendError(f"rendering needs LLVM {MINIMUM_LLVM} or later and {found}; {ADVICE}")


def cuda_present() -> bool:
    """Whether a CUDA driver with at least one GPU answers."""
    name = ctypes.util.find_library("cuda") or "libcuda.so.1"
    try:
        driver = ctypes.CDLL(name)
        count = ctypes.c_int()
        return driver.cuInit(0) == 0 and driver.cuDeviceGetCount(ctypes.byref(count)) == 0 and count.value > 0
    except (OSError, AttributeError):
        return False


@functools.cache
def load() -> Any:  # Any: the attributes of the module are those of the variant that it is set to
    """Mitsuba with its variant fixed for this process.

    `EPOSIT_VARIANT` chooses between llvm_ad_rgb and cuda_ad_rgb. Without it the CPU renders, also where there is a GPU:
    a recipe gives the same bits on machines of one type of CPU, and a GPU has bits of its own.

    Raises:
        BackendError: unknown variant, no usable LLVM, or another variant already runs in this process.
    """
    variant = os.environ.get("EPOSIT_VARIANT") or CPU_VARIANT
    if variant not in VARIANTS:
        raise BackendError(f"EPOSIT_VARIANT is {variant!r}; it must be one of {', '.join(VARIANTS)}")
    if variant == CPU_VARIANT:
        if "drjit" in sys.modules and LIBRARY_VARIABLE not in os.environ:
            raise BackendError("drjit was imported before render.backend.load(); call load() first")
        os.environ[LIBRARY_VARIABLE] = str(find_llvm())
    elif not cuda_present():
        raise BackendError(f"EPOSIT_VARIANT is {variant!r} and no CUDA GPU answers; unset it to render on the CPU")
    import mitsuba as mi

    if mi.variant() not in (None, variant):
        raise BackendError(f"Mitsuba already runs {mi.variant()!r} here; start a new process for {variant!r}")
    mi.set_variant(variant)
    mi.set_log_level(mi.LogLevel.Error)
    return mi


def jit() -> Any:  # Any: its stubs give `object` for much that our arrays pass through
    """Dr.Jit, for code that works on its arrays; `load` comes first."""
    import drjit

    return drjit


def upload(values: NDArray[Any]) -> Any:
    """(n,) numbers on the device: unsigned integers as 32 bits of them, others as float32.

    Dr.Jit reads NumPy's memory in place, and compiles one kernel for memory that is aligned and another one for memory
    that is not, which is chance. So the numbers are copied to where they are aligned.
    """
    mi, is_count = load(), values.dtype.kind == "u"
    memory = np.empty(4 * values.size + ALIGNMENT, np.uint8)
    first = -memory.ctypes.data % ALIGNMENT
    aligned = memory[first : first + 4 * values.size].view(np.uint32 if is_count else np.float32)
    aligned[:] = values
    return mi.UInt32(aligned) if is_count else mi.Float(aligned)


def opaque(*values: float) -> list[Any]:
    """Numbers that kernels read instead of holding them, so that one kernel serves all values."""
    mi, dr = load(), jit()
    return [dr.opaque(mi.Float, float(value)) for value in values]


def _problem_of(library: Path) -> str | None:
    """Why a library cannot compile our kernels, as the end of a sentence; None if it can.

    A library whose name states an old version is not loaded: its symbols have no place beside a new one's.
    """
    if not library.is_file():
        return "is not a file"
    version = _version_in_name(library)
    if version is None or version >= MINIMUM_LLVM:
        try:
            version = llvm_version(library)
        except OSError as error:
            return f"cannot be loaded ({error})"
    if version is None:
        return "is not an LLVM library"
    return f"is LLVM {version} and would abort the process" if version < MINIMUM_LLVM else None


def _candidates() -> Iterator[Path]:
    """Libraries of the PyPI wheel, then of the system, newest first."""
    packages = [Path(sys.prefix) / "lib", Path(sys.prefix) / "bin"]
    system = [directory for pattern in SYSTEM_FOLDERS for directory in sorted(Path("/").glob(pattern))]
    for directories in (packages, system):
        found = [path for directory in directories for path in directory.glob("libLLVM*") if _version_in_name(path)]
        found += [path for directory in directories for path in directory.glob("LLVM-C.dll")]
        yield from sorted(found, key=lambda path: (_version_in_name(path) or 0, str(path)), reverse=True)


def _version_in_name(library: Path) -> int | None:
    match = re.search(r"libLLVM(?:-|\.so\.)(\d+)", library.name)
    return int(match.group(1)) if match else None
