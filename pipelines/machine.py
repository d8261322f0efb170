"""What a result was made with: versions of the libraries, processor, date."""

from __future__ import annotations

import datetime
import importlib.metadata
import os
import platform
from pathlib import Path

LIBRARIES = (
    "numpy", "scipy", "numba", "mitsuba", "drjit", "opencv-python-headless", "OpenEXR", "pyarrow", "poselib",
)  # fmt: skip


def facts() -> list[tuple[str, str]]:
    """Names and values: versions, processor, cores, date."""
    return [
        ("python", platform.python_version()),
        *((name, version_of(name) or "not installed") for name in LIBRARIES),
        ("processor", f"{_processor()}, {_system()}"),
        ("date", datetime.date.today().isoformat()),
    ]


def versions() -> str:
    """Libraries and machine in one line."""
    found = ", ".join(f"{name} {version_of(name) or 'not installed'}" for name in LIBRARIES)
    return f"Python {platform.python_version()}, {found}; {_system()}"


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


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "unknown")
