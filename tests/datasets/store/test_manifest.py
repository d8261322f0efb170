"""The manifest tells content and provenance apart."""

from __future__ import annotations

import dataclasses
import json

import pytest

from datasets.store.dataset import open_dataset
from datasets.store.manifest import MANIFEST_FILE
from datasets.store.provenance import Provenance
from datasets.verify import verify
from pipelines.machine import LIBRARIES, blas, commit, provenance
from tests.wrong_input import first

HERE = Provenance("abc", "2026-01-01", "3.11.7", (("numpy", "2.4"),), "a processor", "openblas 0.3.31 SkylakeX")


def manifest_of(root):
    return json.loads((root / MANIFEST_FILE).read_text())


def written(root, provenance=None):
    open_dataset(root, provenance).write_manifest()
    return manifest_of(root)


def test_the_content_is_what_verify_says(root):
    dataset = open_dataset(root)
    manifest = written(root)
    assert verify(dataset) == (manifest["content"], [])
    assert manifest["recipe"] == dataset.recipe.digest()
    assert [root / entry["path"] for entry in manifest["shards"]] == [
        path for table in ("frames", "keypoints", "detections", "estimates", "scores") for path in dataset.shards(table)
    ]
    assert {entry["schema_version"] for entry in manifest["shards"]} == {"3"}


def test_the_frames_have_a_hash_of_their_own(root, cli):
    before = written(root)
    assert cli("estimate", root, "--solver", "eposit", "--use", "four", "-q").code == 0
    after = manifest_of(root)
    assert after["content"] != before["content"]
    assert after["frames_content"] == before["frames_content"]
    first(root, "keypoints").unlink()
    assert written(root)["frames_content"] == before["frames_content"]
    first(root, "frames").unlink()
    assert written(root)["frames_content"] != before["frames_content"]


def test_provenance_is_no_part_of_the_content(root):
    (root / MANIFEST_FILE).unlink()
    manifest = written(root, HERE)
    assert manifest["made_with"] == [HERE.entry()]
    assert manifest["made_with"][0]["libraries"] == {"numpy": "2.4"}
    (root / MANIFEST_FILE).unlink()
    other = written(root, dataclasses.replace(HERE, commit="def", date="2027-01-01", processor="another"))
    assert other | {"made_with": []} == manifest | {"made_with": []}


@pytest.mark.parametrize("name", ["commit", "python", "libraries", "processor", "blas"])
def test_each_environment_that_changes_a_shard_is_told_once(name, root):
    (root / MANIFEST_FILE).unlink()
    written(root, HERE)
    other = dataclasses.replace(HERE, date="2026-02-02", **{name: (("numpy", "9"),) if name == "libraries" else "x"})
    assert written(root, other)["made_with"] == [HERE.entry()]  # it has changed nothing
    first(root, "scores").unlink()
    assert written(root, other)["made_with"] == [HERE.entry(), other.entry()]
    first(root, "estimates").unlink()
    later = dataclasses.replace(other, date="2026-03-03")
    assert written(root, later)["made_with"] == [HERE.entry(), other.entry()]
    assert written(root)["made_with"] == [HERE.entry(), other.entry()]


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"shards": [1]}', '{"shards": [{}]}', "\0"])
def test_a_manifest_that_says_nothing_is_made_again(text, root):
    (root / MANIFEST_FILE).write_text(text)
    assert written(root, HERE)["made_with"] == [HERE.entry()]


def test_this_environment(tiny):
    here = provenance()
    assert [name for name, _ in here.libraries] == list(LIBRARIES)
    assert "not installed" not in dict(here.libraries).values()
    assert blas() == here.blas != "unknown"
    assert commit() == here.commit
    (entry,) = manifest_of(tiny[1])["made_with"]
    assert entry | {"date": "", "commit": ""} == here.entry() | {"date": "", "commit": ""}
