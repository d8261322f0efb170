"""What a command is about to take is told before it starts; what the disk cannot hold is refused."""

from __future__ import annotations

import re

import pytest

from pipelines.cost import before
from tests.wrong_input import assert_one_sentence


@pytest.fixture
def free(monkeypatch):
    """Sets the free space of every disk, bytes."""
    return lambda size: monkeypatch.setattr(before, "free_bytes", lambda folder: size)


def test_a_run_says_what_it_takes_before_it_starts(place, cli):
    done = cli("generate", place.recipe(place.text), "--out", place.new(), "--reuse", place.source)
    assert done.code == 0
    told = r"2 of 2 frames to make, 1 in a shard: about [0-9.]+ seconds with 1 worker, \S+ [kMG]?B of the .* are free"
    assert re.search(told, done.out)
    assert done.out.index("frames to make") < done.out.index("linear images:")


def test_what_the_disk_cannot_hold_is_refused_before_anything_is_written(place, cli, free):
    free(1000)
    recipe, root = place.recipe(place.text), place.new()
    for command in ("generate", "run"):
        done = cli(command, recipe, "--out", root, "-q")
        assert done.code == 2
        assert_one_sentence(done.code, done.err, "with a margin of 10%, and its disk has 1 kB free")
        assert "--no-masters, or go on with --ignore-disk" in done.err
        assert not root.exists()
    assert cli("generate", recipe, "--out", root, "--reuse", place.source, "--ignore-disk", "-q").code == 0


def test_what_is_there_needs_no_room(place, cli, free):
    recipe, root = place.recipe(place.text), place.new()
    assert cli("generate", recipe, "--out", root, "--reuse", place.source, "-q").code == 0
    free(0)
    done = cli("generate", recipe, "--out", root)
    assert done.code == 0
    assert "frames to make" not in done.out
    (root / "frames" / "frames-00000-of-00002.parquet").unlink()
    assert cli("generate", recipe, "--out", root, "-q").code == 2
    free(10**9)
    assert "1 of 2 frames to make" in cli("generate", recipe, "--out", root).out


def test_what_is_packed_needs_room_twice_for_a_moment(place, cli, free):
    """Two shards: with one worker one of them is there as single files and as an archive."""

    def wanted(*options):
        free(0)
        done = cli("generate", place.recipe(place.text), "--out", place.new(), "-q", *options)
        assert done.code == 2
        return re.search(r"needs about (\d+) (kB|MB)", done.err)

    single, packed = wanted(), wanted("--pack-masters")
    assert (single[2], packed[2]) == ("kB", "kB")
    assert 1.3 < int(packed[1]) / int(single[1]) < 1.5  # linear images are nine tenths


def test_free_space_is_that_of_the_nearest_folder_that_is_there(tmp_path):
    assert before.free_bytes(tmp_path / "a" / "b") > 0
