"""What a program pays once: import of `eposit`, and the first call, without and with the cache of machine code."""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator

from pipelines.bench.table import Figure

REPEATS = 3
PROGRAM = """
import time
times = [time.process_time()]
import numpy as np
times.append(time.process_time())
import eposit
times.append(time.process_time())
camera = eposit.Camera(lens="equisolid", fx=552.4, fy=552.7, cx=782.4, cy=613.7, width=1600, height=1200)
corners = [(0.0, 0, 0), (200, 0, 0), (0, 200, 0), (0, 0, -50)]
points = np.array([*corners, (200, 200, 0), (9, 80, 30), (30, 7, 20), (0, 9, 9)])
pixels = camera.project(points + (100, 100, 2000))
for options in ({}, {"method": "eposit"}, {"robust": True}):
    times.append(time.process_time())
    assert eposit.solve(points, pixels, camera, **options).status == "ok"
    times.append(time.process_time())
print(*(b - a for a, b in zip(times, times[1:])))
"""
NAMES = ("import numpy", "import eposit after numpy", "", "first call of best", "", "of eposit", "", "of robust")


def rows(part: str) -> Iterator[Figure]:
    """Seconds of processor time, medians of processes of their own; each pair has an empty cache, then that cache."""
    pairs = [_pair() for _ in range(REPEATS)]
    for i, name in enumerate(NAMES):
        if name:
            empty, kept = (statistics.median(pair[j][i] for pair in pairs) for j in (0, 1))
            yield Figure(
                part, f"{name}, processor time", f"{empty:.3f} s", "with the cache of machine code", f"{kept:.3f} s"
            )


def _pair() -> tuple[list[float], list[float]]:
    with tempfile.TemporaryDirectory() as folder:
        return _seconds(folder), _seconds(folder)


def _seconds(folder: str) -> list[float]:
    """Times between the marks of the program, whose caches lie in the folder."""
    places = dict.fromkeys(("XDG_CACHE_HOME", "LOCALAPPDATA", "HOME", "TMPDIR", "TEMP", "TMP"), folder)
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], env={**os.environ, **places}, capture_output=True, text=True, check=True
    )
    return [float(word) for word in done.stdout.split()]
