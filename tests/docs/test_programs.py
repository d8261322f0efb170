"""Python in the documents runs, and so does every example, each by itself as a user starts it."""

import subprocess
import sys

import pytest

from tests.docs.documents import EXAMPLES, ROOT, programs

PROGRAMS = list(programs())
MOST_LINES = 40
TAKES_A_DATASET = {"own_estimator.py", "read_dataset.py"}


def printed(*words):
    done = subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("number", range(len(PROGRAMS)))
def test_python_in_the_documents_runs(number, capsys):
    document, text = PROGRAMS[number]
    exec(compile(text, document, "exec"), {"__name__": "__main__"})
    out = capsys.readouterr().out
    assert ("print(" in text) == bool(out)
    assert "nan" not in out


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_an_example_runs(path, tiny):
    out = printed(path, *([tiny[1]] if path.name in TAKES_A_DATASET else []))
    assert out.strip()
    assert "nan" not in out


def test_examples_are_short_and_named_in_the_readme():
    readme = (ROOT / "README.md").read_text()
    assert len(EXAMPLES) >= 6
    for path in EXAMPLES:
        assert len(path.read_text().splitlines()) < MOST_LINES, path
        assert f"`{path.name}`" in readme, path
