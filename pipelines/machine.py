"""What a result was made with: versions of the libraries, processor, date."""

from __future__ import annotations

import datetime
import functools
import importlib.metadata
import os
import platform
import subprocess
from pathlib import Path

from datasets.store.provenance import Provenance

GIT_S = 10.0  # what git may take before the commit counts as unknown
LIBRARIES = (
    "numpy", "scipy", "llvmlite", "numba", "mitsuba", "drjit", "opencv-python-headless", "OpenEXR", "pyarrow",
    "poselib",
)  # fmt: skip


def facts() -> list[tuple[str, str]]:
    """Names and values: versions, processor, cores, date."""
    return [
        ("python", platform.python_version()),
        *((name, version_of(name) or "not installed") for name in LIBRARIES),
        ("processor", f"{processor()}, {_system()}"),
        ("date", datetime.date.today().isoformat()),
    ]


def versions() -> str:
    """Libraries and machine in one line."""
    found = ", ".join(f"{name} {version_of(name) or 'not installed'}" for name in LIBRARIES)
    return f"Python {platform.python_version()}, {found}; {_system()}"


def provenance() -> Provenance:
    """What the manifest of a dataset says of this environment."""
    return Provenance(
        commit=commit(),
        date=datetime.date.today().isoformat(),
        python=platform.python_version(),
        libraries=tuple((name, version_of(name) or "not installed") for name in LIBRARIES),
        processor=f"{processor()}, {platform.system()} {platform.machine()}",
        blas=blas(),
    )


@functools.cache  # each command of a process asks, and the code that it runs is that of its start
def commit() -> str:
    """The commit of this checkout, `with changes` behind it if files differ from it; unknown without git."""
    try:
        found = _git("rev-parse", "HEAD")
        return f"{found} with changes" if _git("status", "--porcelain", "--untracked-files=no") else found
    except (OSError, subprocess.SubprocessError):
        return "unknown"


def _git(*words: str) -> str:
    command = ["git", "-C", str(Path(__file__).parents[1]), *words]
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=GIT_S).stdout.strip()


def blas() -> str:
    """Name, version and kernel of NumPy's and SciPy's linear algebra: the kernel decides the last bits of a product."""
    import scipy.linalg  # noqa: F401  both libraries are then loaded, whatever was before
    from threadpoolctl import threadpool_info

    found = {
        " ".join(str(pool[key]) for key in ("internal_api", "version", "architecture") if pool.get(key))
        for pool in threadpool_info()
        if pool["user_api"] == "blas"
    }
    return ", ".join(sorted(found)) or "unknown"


@functools.cache
def version_of(library: str) -> str | None:
    """A library's version, None if it is not installed."""
    try:
        return importlib.metadata.version(library)
    except importlib.metadata.PackageNotFoundError:
        return None


def usable_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _system() -> str:
    return f"{platform.system()} {platform.machine()}, {usable_cores()} cores"


def processor() -> str:
    """Name of this machine's processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "unknown")
