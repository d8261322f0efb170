"""Changes that are no regressions: nights of another BLAS kernel, another OpenCV, another order of operations.

Each runs as a night of its own process on real pictures. It must end with exit code 0, and tell what is other. What was
found is kept in `out/studies`, from which `docs/evidence/nightly-changes.md` is written.
"""

from __future__ import annotations

import json
import os
import resource
import shutil
import subprocess
import sys

import pytest

from datasets.recipe.model import load_recipe
from pipelines.nightly.history import History
from pipelines.nightly.other_code import PACKAGES, ROOT, RUN_COMMANDS, Code
from tests.pipelines.nightly.studies import found
from tests.pipelines.nightly.studies.pages import changes_page

pytestmark = pytest.mark.slow

POSES = 8
OPENCV = "4.12.0.88"
SUM = "np.add.reduce(force, axis=0"  # of the gradient over the points, in `eposit.refine.reprojection`
REVERSED = "np.add.reduce(force[::-1], axis=0"


@pytest.fixture(scope="module")
def nights(tmp_path_factory):
    """A copy of the code, a history whose first night is the baseline, and the recipe."""
    folder = tmp_path_factory.mktemp("changes")
    code, history, recipe = (folder / name for name in ("code", "nights", "few.toml"))
    for package in PACKAGES:
        shutil.copytree(ROOT / package, code / package, ignore=shutil.ignore_patterns("__pycache__"))
    recipe.write_text(load_recipe("nightly")[1].replace("count = 80", f"count = {POSES}"))
    assert _night(code, history, recipe, {}, "--without", "fresh")["exit"] == 3  # no baseline yet
    assert _run(code, {}, "accept", "latest", "--history", history, "--reason", "the first").returncode == 0
    return code, history, recipe


def _run(code, environment, *words):
    """Run a command of `nightly` by the code in a folder."""
    return subprocess.run(
        Code(code).command(RUN_COMMANDS, json.dumps([["nightly", *map(str, words)]])),
        env=os.environ | environment, capture_output=True, text=True, check=False,
    )  # fmt: skip


def _night(code, history, recipe, environment, *words):
    """Run a night by the code in a folder, and return its row of the history."""
    options = ("--regime", "typical", "--without", "speed", "--quiet", "--seed", 5, *words)
    done = _run(code, environment, "run", recipe, "--history", history, *options)
    row = History(history).run("latest")
    assert done.returncode == row["exit"], done.stderr
    return row


def _judged(change, row):
    begun = resource.getrusage(resource.RUSAGE_CHILDREN)
    gates = {item["gate"]: [item["state"], item["sentence"]] for item in row["gates"]}
    values = {"change": change, "exit": row["exit"], "gates": gates, "processor_s": begun.ru_utime + begun.ru_stime}
    found.keep(f"changes-{change}", values)
    changes_page()
    assert row["exit"] == 0
    assert {state for state, _ in gates.values()} <= {"passed", "changed", "not run"}
    return gates


def test_no_change(nights):
    gates = _judged("none", _night(*nights, {}))
    assert {state for state, _ in gates.values()} <= {"passed", "not run"}


@pytest.mark.parametrize("kernel", ["Haswell", "Nehalem"])
def test_another_blas_kernel(nights, kernel):
    gates = _judged(f"BLAS kernel {kernel}", _night(*nights, {"OPENBLAS_CORETYPE": kernel}))
    assert gates["regenerate"][0] == "changed"
    assert f"{kernel} instead of " in gates["regenerate"][1] or f"{kernel}, " in gates["regenerate"][1]


def test_another_opencv(nights, tmp_path):
    wanted = ["install", "--quiet", "--no-deps", "--target", tmp_path, f"opencv-python-headless=={OPENCV}"]
    subprocess.run([sys.executable, "-m", "pip", *map(str, wanted)], check=True)
    gates = _judged(f"OpenCV {OPENCV}", _night(*nights, {"PYTHONPATH": str(tmp_path)}))
    assert f"opencv-python-headless is {OPENCV} instead of " in gates["regenerate"][1]


def test_another_order_of_operations(nights, tmp_path):
    """The gradient's sum over the points from the last to the first, in a copy of the code."""
    shutil.copytree(nights[0], tmp_path, dirs_exist_ok=True)
    path = tmp_path / "eposit" / "refine" / "reprojection.py"
    assert SUM in path.read_text()
    path.write_text(path.read_text().replace(SUM, REVERSED))
    gates = _judged("points summed in reverse", _night(tmp_path, *nights[1:], {}))
    assert gates["replay"][0] == "changed"
    assert "the code is not the baseline's" in gates["replay"][1]
