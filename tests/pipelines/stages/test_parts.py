"""Parts of the shards by several processes make the dataset that one process makes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from datasets.errors import UserError
from datasets.store.known_shards import KNOWN_FILE
from datasets.store.lock import hold
from pipelines.stages.part import WHOLE, Part, part_of
from tests.conftest import command
from tests.timeless import timeless
from tests.wrong_input import assert_one_sentence, files

MADE = ("recipe.toml", "manifest.json", "README.md")
STAGES = ("detect", "estimate", "score")


@pytest.fixture(scope="module")
def four(tiny, tmp_path_factory):
    """Recipe file and folder of four frames, a shard each, made by one process."""
    folder = tmp_path_factory.mktemp("parts")
    recipe = folder / "four.toml"
    recipe.write_text(tiny[0].replace("step = 90", "step = 30"))
    assert command("run", recipe, "--out", folder / "whole", "-q") == 0
    return recipe, folder / "whole"


@pytest.fixture
def two(tiny, tmp_path):
    """Recipe file and folder of two frames, a shard each, made by one process."""
    recipe = tmp_path / "two.toml"
    recipe.write_text(tiny[0])
    return recipe, tiny[1]


def started(*words):
    root = Path(__file__).parents[3]
    return subprocess.Popen([sys.executable, "-m", "pipelines", *map(str, words)], cwd=root, stdout=subprocess.DEVNULL)


def assert_equal(root, source, content, names=MADE):
    assert content(root) == content(source)
    for name in names:
        assert timeless(root / name) == timeless(source / name)
    assert {path.name for path in root.rglob(".*")} <= {KNOWN_FILE}


@pytest.mark.parametrize("count", [1, 2, 3, 7])
@pytest.mark.parametrize("shards", [0, 1, 5, 12])
def test_every_shard_is_in_one_part(shards, count):
    parts = [Part(number, count).indices(shards) for number in range(1, count + 1)]
    assert sorted(index for part in parts for index in part) == list(range(shards))
    assert max(map(len, parts)) - min(map(len, parts)) <= 1


def test_part_of():
    assert part_of(None) == part_of("1/1") == WHOLE
    assert part_of("3/4") == Part(3, 4)
    assert not part_of("3/4").is_whole


@pytest.mark.parametrize(
    "text", ["", "1", "0/4", "5/4", "-1/4", "1/0", "a/b", "1/4/2", "1.5/2", " 1/4", "1/4\n", "\u0661/\u0664"]
)
def test_a_wrong_part_is_a_sentence(text):
    with pytest.raises(UserError, match="is not usable; give --shard I/N with I from 1 to N"):
        part_of(text)


def test_poses_of_a_file_have_no_parts(root, cli):
    before = files(root)
    outcome = cli("score", root, "--poses", "poses.csv", "--name", "theirs", "--shard", "1/2")
    assert_one_sentence(outcome.code, outcome.err, "--poses takes a file as a whole; leave out --shard")
    assert files(root) == before


@pytest.mark.full
def test_four_processes_at_once_and_then_the_report(four, tmp_path, cli, content):
    recipe, source = four
    root = tmp_path / "dataset"
    parts = [started("run", recipe, "--out", root, "--shard", f"{number}/4", "-q") for number in range(1, 5)]
    assert [part.wait(120) for part in parts] == [0] * 4
    assert not (root / "manifest.json").exists()
    assert cli("report", root).code == 0
    assert_equal(root, source, content, (*MADE, "report.html"))


@pytest.mark.usefixtures("no_report")
def test_stages_in_parts_in_any_order_and_a_plain_run_completes(two, tmp_path, cli, content):
    recipe, source = two
    root = tmp_path / "dataset"
    assert cli("generate", recipe, "--out", root, "--shard", "2/2", "-q").code == 0
    assert sorted(path.name for path in (root / "frames").iterdir()) == ["frames-00001-of-00002.parquet"]
    for stage in STAGES:  # a part needs no other part's shards
        assert cli(stage, root, "--shard", "2/2", "-q").code == 0
    assert [path.name.split("-of-")[0][-5:] for path in (root / "scores").iterdir()] == ["00001"]
    refused = cli("estimate", root, "--shard", "1/2", "-q")
    assert_one_sentence(refused.code, refused.err, "is missing; run the generate stage")
    refused = cli("score", root, "--shard", "1/2", "-q")
    assert_one_sentence(refused.code, refused.err, "is missing; run the estimate stage")
    assert cli("run", recipe, "--out", root, "--shard", "1/2", "-q").code == 0  # the settings of a run, in this part
    assert cli("run", recipe, "--out", root, "-q").code == 0
    assert_equal(root, source, content)


def test_a_part_that_is_done_and_one_without_shards_say_so(two, cli):
    recipe, source = two
    before = files(source)
    assert "generate: all 1 shards are there" in cli("generate", recipe, "--out", source, "--shard", "1/2").out
    assert "generate: no shard is in this part" in cli("generate", recipe, "--out", source, "--shard", "5/5").out
    assert cli("run", recipe, "--out", source, "--shard", "5/5").code == 0
    assert files(source) == before


def test_overwrite_leaves_other_parts_alone(root, cli, content):
    before, found = content(root), files(root)
    assert cli("estimate", root, "--shard", "2/2", "--overwrite", "-q").code == 0
    after = files(root)
    lost = {path.relative_to(root).as_posix() for path in found.keys() - after.keys()}
    assert lost == {"scores/best-detected-exact-all-00001-of-00002.parquet"}
    made = {path.relative_to(root).as_posix() for path in after if found.get(path) != after[path]}
    assert made == {"estimates/best-detected-exact-all-00001-of-00002.parquet"}
    assert cli("score", root, "--shard", "2/2", "-q").code == 0
    assert content(root) == before


def test_parts_share_a_folder_and_a_plain_command_does_not_join_them(root, cli):
    with hold(root, shared=True):
        assert cli("estimate", root, "--solver", "posit", "--shard", "1/2", "-q").code == 0
        refused = cli("estimate", root, "--solver", "posit", "-q")
        assert_one_sentence(refused.code, refused.err, "is being written by")
    with hold(root):
        refused = cli("estimate", root, "--solver", "posit", "--shard", "2/2", "-q")
        assert_one_sentence(refused.code, refused.err, "is being written by")


@pytest.mark.usefixtures("no_figures")
def test_the_report_lists_what_parts_have_made_unless_somebody_still_writes(root, cli):
    (root / "manifest.json").unlink()
    with hold(root, shared=True):
        done = cli("report", root)
    assert done.code == 0
    assert f"the manifest stays as it is, as {root} is being written by" in done.err
    assert not (root / "manifest.json").exists()
    assert cli("report", root).code == 0
    listed = {entry["path"] for entry in json.loads((root / "manifest.json").read_text())["shards"]}
    assert listed == {path.relative_to(root).as_posix() for path in root.rglob("*.parquet")}
