"""The five walks through the code are those of a real run."""

import json
import re
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from tests.conftest import TINY

ROOT = Path(__file__).resolve().parents[2]
STEP = re.compile(r"^\d+\. `([^`]+)` `([^`]+)`: ", flags=re.M)
MOST_VISITS = 2

# Runs the command and prints each call of a function of interest, consecutive ones once.
RECORDER = """
import json, sys, threading
root, wanted = sys.argv[1] + "/", {tuple(step) for step in json.loads(sys.argv[2])}
places = {}
calls = []

def record(frame, event, _):
    if event == "call":
        code = frame.f_code
        if code not in places:
            place = code.co_filename.removeprefix(root), code.co_name
            places[code] = place if place in wanted else None
        place = places[code]
        if place and (not calls or calls[-1] != place):
            calls.append(place)

threading.setprofile(record)
sys.setprofile(record)
from pipelines.cli import main
sys.argv = ["pipelines", *sys.argv[3:]]
code = main()
sys.setprofile(None)
threading.setprofile(None)
print(json.dumps(calls))
sys.exit(code)
"""


def walks():
    """Title to steps, each a file and a function."""
    parts = re.split(r"^## (.*)$", (ROOT / "docs" / "walks.md").read_text(), flags=re.M)[1:]
    return {title: STEP.findall(text) for title, text in zip(parts[::2], parts[1::2], strict=True)}


@pytest.fixture(scope="module")
def calls(tmp_path_factory):
    folder = tmp_path_factory.mktemp("walks")
    recipe = folder / "tiny.toml"
    recipe.write_text(TINY)
    steps = sorted({step for walk in walks().values() for step in walk})
    words = ["run", recipe, "--out", folder / "dataset", "--quiet"]
    command = [sys.executable, "-c", RECORDER, str(ROOT), json.dumps(steps), *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=folder)
    return [tuple(call) for call in json.loads(done.stdout.splitlines()[-1])]


def test_there_are_five():
    assert [len(steps) > 5 for steps in walks().values()] == [True] * 5


@pytest.mark.full
@pytest.mark.parametrize("title", walks())
def test_a_walk_is_what_a_run_does(title, calls):
    """Its steps are called in their order; other calls may lie between."""
    rest = iter(calls)
    for step in walks()[title]:
        assert step in rest, f"{step} is not called after the steps before it"


@pytest.mark.parametrize("title", walks())
def test_no_file_is_entered_more_than_twice(title):
    files = [file for file, _ in walks()[title]]
    entered = Counter(file for before, file in zip([None, *files], files, strict=False) if file != before)
    assert max(entered.values()) <= MOST_VISITS
