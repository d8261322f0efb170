"""Hostile inputs of every kind, and runs that are interrupted: one sentence, nothing lost, limits kept."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def outcome(*words):
    """Run a module in a process of its own: it forks, which a process with threads of other tests may not."""
    return subprocess.run([sys.executable, "-m", *words], cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    "kind",
    ["recipes", "tables", "pictures", "linear_images", "archives", "poses", "options", "functions", "arrays"],
)
def test_a_hundred_and_thirty_inputs(kind):
    done = outcome("tests.hostile", "--only", kind, "--cases", "130")
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-2000:]


@pytest.mark.slow
@pytest.mark.parametrize("words", [("--kills", "70"), ("--signals", "60"), ("--files", "20"), ("--disks", "20")])
def test_interrupted_runs_go_on(words):
    """The file systems in memory need the right to mount."""
    done = outcome("tests.hostile.interruptions", *words)
    assert done.returncode == 0, done.stdout[-5000:] + done.stderr[-2000:]
