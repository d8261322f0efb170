"""What a measurement was made with."""

from __future__ import annotations

import datetime
import importlib.metadata
import os
import platform
from pathlib import Path

LIBRARIES = ("mitsuba", "drjit", "numpy", "opencv-python-headless", "OpenEXR", "poselib")


def facts() -> list[tuple[str, str]]:
    """Names and values: versions, processor, cores, date."""
    versions = [(name, _version(name)) for name in LIBRARIES]
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return [
        ("python", platform.python_version()),
        *versions,
        ("processor", f"{_processor()}, {cores} cores, {platform.system()} {platform.machine()}"),
        ("date", datetime.date.today().isoformat()),
    ]


def one_line() -> str:
    """The facts in a sentence."""
    return ", ".join(f"{name} {value}" for name, value in facts())


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor() or "unknown"
    return next((line.partition(":")[2].strip() for line in lines if line.startswith("model name")), "unknown")
