"""Datasets put into a store and fetched again: nothing of another dataset is replaced, nothing is transferred twice."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest

from datasets.remote.places import in_order, is_of_dataset
from datasets.store.atomic import write_text
from datasets.store.dataset import open_dataset
from datasets.url_path import dataset_folder
from datasets.verify import verify
from tests.wrong_input import assert_one_sentence, first

PATIENCE_S = 60.0


def content(root):
    """Every file of a dataset's folder by its path, but for what only this machine needs."""
    files = (path for path in root.rglob("*") if path.is_file() and not path.name.startswith("."))
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in files}


def test_a_dataset_comes_back_as_it_was(root, tmp_path, cli):
    url = f"file://{tmp_path}/store/demo"
    before = content(root)
    put = cli("upload", root, url)
    assert (put.code, put.out) == (0, f"{len(before)} new files in {tmp_path}/store/demo\n")
    assert content(tmp_path / "store" / "demo") == before
    assert cli("upload", root, url).out.startswith("0 new files")
    fetched = cli("download", url, tmp_path / "fetched")
    assert (fetched.code, fetched.err) == (0, "")
    assert content(tmp_path / "fetched") == before
    assert verify(open_dataset(tmp_path / "fetched")) == verify(open_dataset(root))
    first(tmp_path / "fetched", "scores").unlink()
    assert cli("download", url, tmp_path / "fetched").out.startswith("1 new files")
    assert content(tmp_path / "fetched") == before
    first(tmp_path / "store" / "demo", "frames").unlink()
    assert cli("upload", root, url).out.startswith("1 new files")


def test_another_dataset_is_neither_replaced_nor_mixed(root, tmp_path, cli):
    url, kept = f"file://{tmp_path}/store", tmp_path / "store"
    assert cli("upload", root, url).code == 0
    shard = first(kept, "frames")
    sound = shard.read_bytes()
    shard.write_bytes(sound[:-1] + b"x")
    refused = cli("upload", root, url)
    assert_one_sentence(refused.code, refused.err, "has another frames/")
    assert shard.read_bytes() == sound[:-1] + b"x"
    shard.write_bytes(sound)
    (kept / "masters" / "000007.exr").write_bytes(b"of a longer one")
    refused = cli("upload", root, url)
    assert_one_sentence(refused.code, refused.err, "has masters/000007.exr, which")
    (kept / "masters" / "000007.exr").unlink()
    recipe = kept / "recipe.toml"
    recipe.write_text(recipe.read_text().replace("seed = 5", "seed = 6"))
    refused = cli("download", url, root)
    assert_one_sentence(refused.code, refused.err, "of another recipe")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "mine").write_text("mine")
    refused = cli("download", url, tmp_path / "full")
    assert_one_sentence(refused.code, refused.err, "is not an empty folder")


def test_what_cannot_be_transferred_is_told(root, tmp_path, cli):
    for url in ("out/demo", "http://example.org/demo", "s3://bucket", "s3://", "file://"):
        refused = cli("upload", root, url)
        assert_one_sentence(refused.code, refused.err, "as s3://bucket/demo")
    secret = cli("upload", root, "s3://key:secret@bucket/demo?colour=red")
    assert_one_sentence(secret.code, secret.err, "s3://bucket cannot be used: Unexpected query")
    assert "secret@" not in secret.err
    empty = cli("download", f"file://{tmp_path}/nothing", tmp_path / "new")
    assert_one_sentence(empty.code, empty.err, "holds no dataset")
    assert not (tmp_path / "new").exists()
    (root / "manifest.json").write_text("{}")
    refused = cli("upload", root, f"file://{tmp_path}/store")
    assert_one_sentence(refused.code, refused.err, "has no manifest that is whole")


def test_only_files_of_a_dataset_are_transferred():
    good = ["recipe.toml", "frames/frames-00000-of-00001.parquet", "masters/000000.exr", "light/baked.exr"]
    assert all(is_of_dataset(place) for place in good)
    for place in (
        "../x",
        "frames/../recipe.toml",
        "frames/x.parquet",
        ".lock-a",
        "masters/a/000000.exr",
        "/etc/passwd",
    ):
        assert not is_of_dataset(place)
    assert in_order(["manifest.json", "README.md", *good[::-1]])[0] == "recipe.toml"
    assert in_order(["manifest.json", "README.md", *good[::-1]])[-2:] == ["README.md", "manifest.json"]


@pytest.mark.full
def test_a_dataset_goes_to_an_s3_server_and_back(root, tmp_path, cli, server):
    url = f"s3://a:b@bucket/some/demo?{server}"
    before = content(root)
    put = cli("upload", root, url)
    assert (put.code, put.out) == (0, f"{len(before)} new files in s3://bucket/some/demo\n")
    assert cli("upload", root, url).out.startswith("0 new files")
    assert cli("download", url, tmp_path / "fetched").code == 0
    assert content(tmp_path / "fetched") == before
    assert verify(open_dataset(tmp_path / "fetched"))[1] == []
    store = dataset_folder(url)
    write_text(store / first(root, "frames").relative_to(root), "another")
    refused = cli("upload", root, url)
    assert_one_sentence(refused.code, refused.err, "has another frames/")
    lost = cli("download", url.replace("bucket", "no-bucket"), tmp_path / "new")
    assert_one_sentence(lost.code, lost.err, "holds no dataset")


@pytest.mark.full
@pytest.mark.parametrize("moment", [0.2, 0.5, 0.8])
def test_a_kill_while_files_are_put_leaves_whole_files_only(root, tmp_path, cli, server, moment):
    url = f"s3://a:b@bucket/killed{moment}?{server}"
    before, store = content(root), dataset_folder(url)
    command = [sys.executable, "-m", "pipelines", "upload", str(root), url]
    running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + PATIENCE_S
    while len(store.sizes()) < moment * len(before) and time.monotonic() < deadline:
        pass
    running.send_signal(signal.SIGKILL)
    running.wait()
    there = store.sizes()
    assert there == {place: len(before[place]) for place in there}
    assert cli("upload", root, url).code == 0
    assert cli("download", url, tmp_path / "fetched").code == 0
    assert content(tmp_path / "fetched") == before
