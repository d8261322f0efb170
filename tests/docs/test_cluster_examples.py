"""The scripts for clusters: sound shell, options that exist, and what they call, with stand-ins for cluster and ssh."""

import os
import re
import shutil
import subprocess
import sys

import pytest

from tests.docs.documents import COMMANDS, ROOT
from tests.timeless import timeless

SCRIPTS = sorted((ROOT / "examples" / "cluster").glob("*.sh"))

# Runs the tasks of an array one after the other, and a wrapped command at once.
SBATCH = """\
#!/usr/bin/env bash
echo "sbatch $*" >> "$CALLS"
if [[ $1 == --parsable ]]; then
    count=${2#--array=1-}
    for ((task = 1; task <= count; task++)); do
        SLURM_ARRAY_TASK_ID=$task SLURM_ARRAY_TASK_COUNT=$count bash "${@:3}" >> "$CALLS" || exit
    done
    echo 77
else
    bash -c "${@: -1}" >> "$CALLS"
fi
"""
SSH = """\
#!/usr/bin/env bash
echo "ssh $1" >> "$CALLS"
bash -c "$2"
"""
TOLD = """\
#!/usr/bin/env bash
echo "$(basename "$0") $*" >> "$CALLS"
"""


@pytest.fixture
def stand_ins(tmp_path, monkeypatch):
    """A folder of commands that comes first in the path, and the file in which they tell how they were called."""
    folder, calls = tmp_path / "bin", tmp_path / "calls"
    folder.mkdir()
    for name, text in {"sbatch": SBATCH, "ssh": SSH, "ray": TOLD, "python": TOLD}.items():
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{folder}:{os.environ['PATH']}")
    monkeypatch.setenv("CALLS", str(calls))
    return folder, calls


def run(script, *words):
    path = ROOT / "examples" / "cluster" / script
    return subprocess.run([path, *map(str, words)], cwd=ROOT, capture_output=True, text=True, timeout=600, check=False)


def test_there_are_two():
    assert [path.name for path in SCRIPTS] == ["ray.sh", "slurm.sh"]


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.name)
def test_the_shell_takes_it_and_its_options_exist(path):
    subprocess.run(["bash", "-n", path], check=True)
    found = re.findall(r"-m pipelines (\w+)(.*)$", path.read_text(), flags=re.M)
    assert found
    for command, words in found:
        known = {option for parameter in COMMANDS[command].params for option in parameter.opts}
        assert set(re.findall(r"(?<=\s)--?[a-z][a-z-]*", words)) <= known


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.name)
def test_without_arguments_it_says_what_to_give(path):
    done = run(path.name)
    assert done.returncode != 0
    assert "give a recipe" in done.stderr


def test_a_slurm_array_runs_every_part_and_then_the_report(stand_ins, tmp_path, monkeypatch):
    folder, calls = stand_ins
    monkeypatch.setenv("PYTHON", str(folder / "python"))
    root = tmp_path / "a dataset"
    done = run("slurm.sh", "a recipe.toml", root, 3)
    assert done.returncode == 0, done.stderr
    script = ROOT / "examples" / "cluster" / "slurm.sh"
    parts = [f"python -m pipelines run a recipe.toml --out {root} --shard {i}/3 --quiet" for i in (1, 2, 3)]
    submitted, *ran, wrapped, reported = calls.read_text().splitlines()
    assert submitted == f"sbatch --parsable --array=1-3 {script} a recipe.toml {root}"
    assert ran == parts
    assert wrapped.startswith("sbatch --dependency=afterok:77 --kill-on-invalid-dep=yes --wrap ")
    assert reported == f"python -m pipelines report {root}"


@pytest.mark.full
def test_a_slurm_array_makes_the_dataset(tiny, reported, tmp_path, stand_ins, monkeypatch, content):
    monkeypatch.setenv("PYTHON", sys.executable)
    recipe, root = tmp_path / "a recipe.toml", tmp_path / "a dataset"
    recipe.write_text(tiny[0])
    done = run("slurm.sh", recipe, root, 2)
    assert done.returncode == 0, done.stderr
    assert content(root) == content(reported)
    for name in ("manifest.json", "report.html"):
        assert timeless(root / name) == timeless(reported / name)


def test_ray_starts_everywhere_runs_and_stops(stand_ins, tmp_path, monkeypatch):
    folder, calls = stand_ins
    monkeypatch.setenv("BIN", str(folder))
    done = run("ray.sh", "demo", tmp_path / "out", "one", "two")
    assert done.returncode == 0, done.stderr
    lines = calls.read_text().splitlines()
    address = lines[2].removeprefix("ray start --address=")
    assert lines == [
        "ray start --head --port=6379 --disable-usage-stats",
        *("ssh one", f"ray start --address={address}", "ssh two", f"ray start --address={address}"),
        f"python -m pipelines run demo --out {tmp_path / 'out'} --engine ray --ray-address {address}",
        *("ssh one", "ray stop", "ssh two", "ray stop", "ray stop"),
    ]
    assert address.endswith(":6379")


def test_ray_stops_also_after_a_run_that_failed(stand_ins, tmp_path, monkeypatch):
    folder, calls = stand_ins
    monkeypatch.setenv("BIN", str(folder))
    shutil.copy("/bin/false", folder / "python")
    assert run("ray.sh", "demo", tmp_path / "out").returncode == 1
    assert calls.read_text().splitlines() == ["ray start --head --port=6379 --disable-usage-stats", "ray stop"]
