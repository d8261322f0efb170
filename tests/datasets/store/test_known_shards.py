"""The manifest reads the footers of new and changed shards only, and is the same as if it had read all."""

from __future__ import annotations

import json
import shutil

import pytest

from datasets.store import known_shards
from datasets.store.dataset import open_dataset
from datasets.store.known_shards import KNOWN_FILE
from datasets.store.manifest import MANIFEST_FILE
from tests.wrong_input import first


@pytest.fixture
def read(monkeypatch):
    """Names of the shards whose footers have been read since it was cleared."""
    names, original = [], known_shards.shard_entry

    def recorded(root, path):
        names.append(path.name)
        return original(root, path)

    monkeypatch.setattr(known_shards, "shard_entry", recorded)
    return names


def written(root):
    open_dataset(root).write_manifest()
    return json.loads((root / MANIFEST_FILE).read_text())


def test_only_new_and_changed_footers_are_read(root, read, cli):
    (root / KNOWN_FILE).unlink(missing_ok=True)
    manifest = written(root)
    assert len(read) == len(manifest["shards"]) > 4
    read.clear()
    assert written(root) == manifest
    assert read == []
    changed = first(root, "keypoints")
    shutil.copyfile(changed, root / "copy")
    (root / "copy").replace(changed)  # another file of the same content and size
    assert written(root) == manifest
    assert read == [changed.name]
    read.clear()
    assert cli("estimate", root, "--solver", "eposit", "--use", "four", "-q").code == 0
    assert len(read) == 2
    assert all(name.startswith("eposit-") for name in read)


def test_a_shard_that_is_gone_is_no_longer_listed(root, read):
    before = written(root)["shards"]
    gone = first(root, "frames")
    gone.unlink()
    assert [entry["path"] for entry in written(root)["shards"]] == [
        entry["path"] for entry in before if not entry["path"].endswith(gone.name)
    ]


@pytest.mark.parametrize("wrong", ["", "[]", '{"a": 1}', '{"frames/x": [[1], {"path": "frames/x"}]}', "[" * 100_000])
def test_what_was_kept_may_be_lost_or_damaged(root, wrong):
    manifest = written(root)
    (root / KNOWN_FILE).write_text(wrong)
    assert written(root) == manifest


def test_a_damaged_shard_is_told(root, cli):
    written(root)
    first(root, "frames").write_bytes(b"nothing")
    done = cli("report", root)
    assert done.code == 2
