"""Commands in the documents exist with the options that they are given, and the quick ones run."""

import re
import shlex
import shutil
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from typer.main import get_command

from pipelines.cli import app
from tests.docs.documents import ROOT, commands

COMMANDS = get_command(app).commands  # pyright: ignore
LINES = sorted(set(commands()))
# What needs a dataset at most, and seconds at most; the others render, measure or reproduce the paper.
QUICK = {"describe", "detect", "doctor", "estimate", "recipes", "report", "score", "verify"}


@pytest.mark.parametrize(("document", "line"), LINES)
def test_command_and_options_exist(document, line):
    words = shlex.split(line, comments=True)
    command = COMMANDS[words[0]]
    known = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    assert {word for word in words if word.startswith("-")} <= known, f"{document}: {line}"


def test_every_command_has_a_line_in_the_guide():
    guide = (ROOT / "docs" / "guide" / "pipeline.md").read_text()
    assert [name for name in COMMANDS if f"`{name}`" not in guide] == []


@pytest.fixture
def place(root, tmp_path, monkeypatch):
    """A folder with a dataset wherever the documents say one is, the examples, README's solver, a file of poses."""
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
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_quick_commands_run(place, cli):
    """In the order of the documents, on two small frames, each once."""
    ran = set()
    for document, line in commands():
        words = tuple(shlex.split(line, comments=True))
        if words[0] in QUICK and words not in ran:
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
