"""Commands in the documents exist with the options that they are given, and the quick ones run."""

import dataclasses
import re
import shlex
import shutil
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from scipy.spatial.transform import Rotation

from pipelines.nightly.history import History
from pipelines.nightly.other_code import digest_of
from tests.docs.documents import COMMANDS, ROOT, commands, named, wrong_options
from tests.pipelines.nightly import simulated
from tests.pipelines.nightly.whole_nights import results

LINES = sorted(set(commands()))
# What needs a dataset at most, and seconds at most; the others render, measure or reproduce the paper.
QUICK = {"describe", "detect", "doctor", "estimate", "recipes", "report", "score", "verify"}
# What needs a history of nights; `nightly run` and `nightly frame` render.
OF_HISTORY = {"nightly accept", "nightly explain", "nightly report"}


@pytest.mark.parametrize(("document", "line"), LINES)
def test_command_and_options_exist(document, line):
    assert wrong_options(line) == set(), f"{document}: {line}"


def test_every_command_has_a_line_in_the_guide():
    guide = (ROOT / "docs" / "guide" / "pipeline.md").read_text()
    assert [name for name in COMMANDS if f"`{name}`" not in guide] == []


@pytest.fixture
def place(root, tmp_path, monkeypatch):
    """A folder with a dataset wherever the documents say one is, the examples, README's solver, files of poses."""
    for name in {match for _, line in LINES for match in re.findall(r"out/[\w-]+", line)}:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        shutil.copytree(root, tmp_path / name)
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    (solver,) = re.findall(r"```python\n(# mysolver\.py.*?)```", (ROOT / "README.md").read_text(), flags=re.S)
    (tmp_path / "mysolver.py").write_text(solver)
    columns = ["frame_id", *(f"q_{axis}" for axis in "wxyz"), *(f"t_{axis}_mm" for axis in "xyz")]
    rows = pq.read_table(root / "frames", columns=columns).to_pylist()
    lines = [",".join(columns), *(",".join(str(value) for value in row.values()) for row in rows)]
    (tmp_path / "poses.csv").write_text("\n".join(lines) + "\n")
    (tmp_path / "trajectory.txt").write_text("".join(map(of_tum, rows)))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def of_tum(row):
    """A line of a trajectory: the camera's place in the world, m, with the frame's number for its time."""
    inverse = Rotation.from_quat([row[f"q_{axis}"] for axis in "xyzw"]).inv()
    place = inverse.apply([-1e-3 * row[f"t_{axis}_mm"] for axis in "xyz"])
    return " ".join(map(str, (row["frame_id"], *place, *inverse.as_quat()))) + "\n"


def test_quick_commands_run(place, cli):
    """In the order of the documents, on two small frames, each once."""
    ran = set()
    for document, line in commands():
        words = tuple(shlex.split(line, comments=True))
        if named(words) in QUICK and words not in ran and "://" not in line:  # an object store has tests of its own
            ran.add(words)
            done = cli(*words)
            assert done.code == 0, f"{document}: {line}: {done.err}"
    assert {words[0] for words in ran} == QUICK
    statuses = {
        path.name.split("-")[0]: set(pq.read_table(path)["status"].to_pylist())
        for folder in ("demo", "smoke")
        for path in Path("out", folder, "estimates").glob("*@*.parquet")
    }
    assert statuses == {
        name: {"ok"} for name in ("mysolver@solve", "examples.own_solver@solve", "examples.own_estimator@estimate")
    }


def test_commands_on_a_history_run(tmp_path, monkeypatch, cli):
    """Each of the documents' on a night that found equisolid's corners worse."""
    found = results(simulated.corner_bias(0.002))
    code = digest_of()[:16]
    night = dataclasses.replace(found.night, data=(*found.night.data, ("code", code)))
    History(tmp_path / "out" / "nights").append(night, found.findings, found.alpha, found.measures)
    monkeypatch.chdir(tmp_path)
    lines = {line for _, line in LINES if named(shlex.split(line)) in OF_HISTORY}
    assert {named(shlex.split(line)) for line in lines} == OF_HISTORY
    for line in sorted(lines):
        done = cli(*shlex.split(line))
        assert done.code == 0, f"{line}: {done.err}"
