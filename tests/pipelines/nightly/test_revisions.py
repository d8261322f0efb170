"""Two states of the code on the same pictures."""

import shutil
import subprocess

import pytest

from pipelines.nightly import revisions
from pipelines.nightly.other_code import ROOT, freeze
from pipelines.nightly.revisions import is_checkout

SMOKE = ("--recipe", "nightly-smoke", "--quiet")


def _refused(cli, *words):
    done = cli("compare", *words, *SMOKE)
    assert (done.code, done.err.count("\n"), done.err[:7]) == (2, 1, "error: ")
    return done.err


def _commit(folder):
    who = ("-c", "user.name=x", "-c", "user.email=x@y.z", "-c", "commit.gpgsign=false")
    for words in (("init", "-q"), ("add", "-A"), (*who, "commit", "-qm", "x")):
        subprocess.run(["git", "-C", folder, *words], check=True, capture_output=True)


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """A repository of one commit, which takes the place of this checkout's."""
    (tmp_path / "repository").mkdir()
    (tmp_path / "repository" / "README.md").write_text("before the code\n")
    _commit(tmp_path / "repository")
    monkeypatch.setattr(revisions, "ROOT", tmp_path / "repository")
    return tmp_path / "repository"


def test_a_revision_that_git_does_not_know(repository, cli):
    assert "'nosuch' is no dataset, no checkout of this project, and no revision" in _refused(cli, "nosuch", "HEAD")


def test_a_commit_without_the_packages(repository, cli, tmp_path):
    told = _refused(cli, "HEAD", "HEAD", "--out", tmp_path / "out")
    assert "HEAD is from before this project had the packages eposit, render, datasets, pipelines" in told
    assert not (tmp_path / "out").exists()


def test_without_git(cli, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    assert "git is not installed here" in _refused(cli, "HEAD", "HEAD")


def test_a_dataset_and_a_commit_are_not_compared(tiny, cli):
    assert "HEAD holds no dataset" in _refused(cli, tiny[1], "HEAD")


def test_runs_of_a_history_that_is_not_there(cli, tmp_path):
    assert "holds no nights" in _refused(cli, "latest", "latest", "--history", tmp_path)


@pytest.mark.full
def test_a_commit_that_is_worse_and_one_that_cannot_read(tmp_path, cli, monkeypatch):
    """Exit code 1 for a candidate whose poses are off from this checkout's; a code that fails is a sentence."""
    changed = tmp_path / "repository"
    shutil.copytree(freeze(tmp_path / "code"), changed, ignore=shutil.ignore_patterns("__pycache__"))
    solved = changed / "pipelines" / "stages" / "estimate.py"
    text = solved.read_text()
    call = "return _SolverInput(points_in_obj[chosen]"
    shifted = text.replace(call, call.replace("points_in_obj", "1.001 * points_in_obj"))
    assert shifted != text
    assert is_checkout(changed)
    solved.write_text(shifted)
    _commit(changed)
    monkeypatch.setattr(revisions, "ROOT", changed)
    out = ("--out", tmp_path / "out")
    done = cli("compare", ROOT, "HEAD", *out, *SMOKE)
    assert done.code == 1, done.err
    assert "pose_log_t" in done.out
    assert cli("compare", "HEAD", changed, *out, *SMOKE).out == "identical: every number of every frame is the same\n"
    (changed / "eposit" / "__init__.py").write_text("raise ImportError('broken')\n")
    assert "cannot read these pictures" in _refused(cli, ROOT, changed, *out)
