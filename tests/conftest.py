"""A tiny dataset that many tests read, and the command line inside this process."""

from __future__ import annotations

import shutil
import sys
from dataclasses import dataclass

import pytest

from datasets.store.dataset import open_dataset
from datasets.verify import verify
from pipelines.cli import main
from pipelines.commands import stages
from tests.object_store import google_server as google_server
from tests.object_store import refusing_server as refusing_server
from tests.object_store import server as server
from tests.object_store import silent_server as silent_server

pytest.register_assert_rewrite("tests.wrong_input")
from tests.wrong_input import Place  # noqa: E402

# Two frames of 400 x 300 px, a shard each; the board fills the middle of the picture.
TINY = """\
name = "tiny"
description = "two small frames"
seed = 5
samples = 4
shard_frames = 1
four = [[0, 0], [2, 0], [0, 2], "circle"]

[trajectory]
stop = 90
step = 90

[[cameras]]
name = "pinhole"
lens = "perspective"
fx = 344.7
fy = 345.3
cx = 201.9
cy = 150.6
width = 400
height = 300
nominal_f = 338
"""


@dataclass(frozen=True)
class Outcome:
    """What a command left on the terminal."""

    code: int
    out: str
    err: str


def command(*words):
    """Exit code of `python -m pipelines WORDS`, run in this process."""
    before = sys.argv
    sys.argv = ["pipelines", *map(str, words)]
    try:
        return main()
    finally:
        sys.argv = before


@pytest.fixture
def cli(capfd):
    """Run a command here and return its `Outcome`; what libraries write to the file descriptors counts too."""

    def run(*words):
        capfd.readouterr()
        code = command(*words)
        return Outcome(code, *capfd.readouterr())

    return run


@pytest.fixture
def no_report(monkeypatch):
    """A run leaves the report out, as its figures take seconds."""
    monkeypatch.setattr(stages, "_report", lambda dataset: None)


@pytest.fixture
def no_figures(monkeypatch):
    """A report has its texts and tables alone, as its figures take seconds."""
    for name in ("along_helix", "boxes"):
        monkeypatch.setattr(f"pipelines.report.figures.{name}", lambda item, frames: "")


@pytest.fixture(scope="session")
def tiny(tmp_path_factory):
    """The recipe's text and the folder of its dataset with all but a report, which no test may change."""
    folder = tmp_path_factory.mktemp("tiny")
    recipe = folder / "tiny.toml"
    recipe.write_text(TINY)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stages, "_report", lambda dataset: None)  # whose figures take seconds
        assert command("run", recipe, "--out", folder / "dataset", "--quiet") == 0
    return TINY, folder / "dataset"


@pytest.fixture(scope="session")
def reported(tiny, tmp_path_factory):
    """The folder of the dataset with a report of all its kinds of estimates, which no test may change."""
    root = tmp_path_factory.mktemp("reported") / "dataset"
    shutil.copytree(tiny[1], root)
    assert command("report", root) == 0
    return root


@pytest.fixture
def root(tiny, tmp_path):
    """The tiny dataset with one kind of estimate, as every kind's figures take time."""
    root = tmp_path / "dataset"
    shutil.copytree(tiny[1], root)
    for table in ("estimates", "scores"):
        for path in (root / table).iterdir():
            if not path.name.startswith("best-detected-exact-all"):
                path.unlink()
    open_dataset(root).write_manifest()
    return root


@pytest.fixture
def place(tmp_path, tiny, monkeypatch):
    """A `Place` of its own for each test."""
    text, source = tiny
    return Place(tmp_path, text, source, monkeypatch)


@pytest.fixture(scope="session")
def content():
    """Content hash of a sound dataset in a folder."""

    def digest_of(root):
        digest, problems = verify(open_dataset(root))
        assert problems == []
        return digest

    return digest_of
