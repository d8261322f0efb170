"""Linear images of a shard in one archive: the content is the same, also after a stop, and what is wrong is found."""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time
import zipfile

import pytest
from rich.console import Console

from datasets.recipe.model import parse_recipe
from datasets.store import packing
from datasets.store.atomic import copy_file, write_bytes
from datasets.store.claim import claim
from datasets.store.dataset import Dataset
from datasets.store.kept_masters import PACKED, Kept
from datasets.store.packing import pack_masters
from datasets.store.refusals import RECIPE_FILE
from datasets.url_path import UrlPath, dataset_folder
from datasets.verify import verify
from datasets.verify.problems import Kind
from pipelines.engines.local import LocalEngine
from pipelines.stages import generate
from pipelines.stages import run as stages
from pipelines.stages.missing import Execution
from pipelines.stages.repair import repair
from tests.conftest import command
from tests.pipelines.stages.packed_damage import DAMAGES, FIRST, SECOND, TEXT, exchange, flip, masters, problems_of
from tests.wrong_input import assert_one_sentence, files

OFTEN = ("flip in an image", "too many")  # of `DAMAGES`
MOMENTS = 12


class Stop(Exception):
    """Stands for what ends a process."""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Folder with a recipe and its dataset in both forms, `single` and `packed`, which no test may change."""
    folder = tmp_path_factory.mktemp("packed")
    (folder / "recipe.toml").write_text(TEXT)
    for name, options in (("single", []), ("packed", ["--pack-masters"])):
        assert command("generate", folder / "recipe.toml", "--out", folder / name, "-q", *options) == 0
    return folder


@pytest.fixture
def packed(made, tmp_path):
    shutil.copytree(made / "packed", tmp_path / "dataset")
    return tmp_path / "dataset"


@pytest.fixture
def rendered(monkeypatch):
    """Grows with each frame that is rendered."""
    calls, render = [], generate.render_world
    monkeypatch.setattr(generate, "render_world", lambda *a, **k: (calls.append(1), render(*a, **k))[1])
    return calls


def test_the_content_is_that_of_single_files(made, content):
    single, packed = made / "single", made / "packed"
    assert content(packed) == content(single)
    assert json.loads((packed / "manifest.json").read_text())["content"] == content(single)
    assert sorted(masters(packed)) == [FIRST, SECOND]
    unpacked = {}
    for place in (FIRST, SECOND):
        with zipfile.ZipFile(packed / place) as archive:
            unpacked |= {f"masters/{name}": archive.read(name) for name in archive.namelist()}
    assert unpacked == masters(single)
    assert "Linear images are packed" in (packed / "README.md").read_text()
    assert "Linear images" not in (single / "README.md").read_text()


def test_it_is_resumed_as_it_began(made, packed, cli, rendered, content):
    before = masters(packed)
    shutil.rmtree(packed / "frames")
    done = cli("generate", made / "recipe.toml", "--out", packed)
    assert done.code == 0
    assert "linear images are packed, as this dataset was begun with --pack-masters" in done.out
    assert "all 2 shards" in cli("generate", made / "recipe.toml", "--out", packed, "--pack-masters").out
    assert content(packed) == content(made / "packed")
    assert (masters(packed), rendered) == (before, [])


@pytest.mark.parametrize(
    ("begun", "options", "words"),
    [
        ("packed", ["--no-masters"], "was begun with --pack-masters; leave out --no-masters"),
        ("single", ["--pack-masters"], "keeps its linear images as single files; leave out --pack-masters"),
        ("single", ["--pack-masters", "--no-masters"], "exclude each other; leave out one of them"),
        ("none", ["--pack-masters"], "was begun with --no-masters; leave out --pack-masters"),
    ],
)
def test_another_way_than_it_was_begun_is_refused(begun, options, words, made, tmp_path, cli):
    root = tmp_path / "dataset"
    if begun == "none":
        with claim(root, parse_recipe(TEXT, "test"), TEXT, kept=Kept.NOT):
            pass
    else:
        shutil.copytree(made / begun, root)
    before = files(root)
    done = cli("generate", made / "recipe.toml", "--out", root, *options, "-q")
    assert_one_sentence(done.code, done.err, words)
    assert before.items() <= files(root).items()


def stopped(monkeypatch, module, name, calls, *, after=False):
    """Let a function raise `Stop` at its call of a number, before or after it has done its work."""
    whole, count = getattr(module, name), iter(range(1, 99))

    def stop(*words, **options):
        is_last = next(count) == calls
        if is_last and not after:
            raise Stop
        found = whole(*words, **options)
        if is_last:
            raise Stop
        return found

    monkeypatch.setattr(module, name, stop)


@pytest.mark.parametrize(
    ("module", "name", "calls", "after"),
    [
        pytest.param(generate, "write_linear", 2, False, id="rendering"),
        pytest.param(packing, "write_archive", 1, False, id="before the archive", marks=pytest.mark.full),
        pytest.param(packing, "write_archive", 1, True, id="after it", marks=pytest.mark.full),
        pytest.param(packing, "linear_path", 2, False, id="removing files"),
        pytest.param(Dataset, "write_shard", 1, False, id="before tables"),
        pytest.param(Dataset, "write_shard", 1, True, id="between tables", marks=pytest.mark.full),
    ],
)
def test_a_run_that_stops_between_two_steps_goes_on(
    module, name, calls, after, made, tmp_path, cli, rendered, monkeypatch, content
):
    root = tmp_path / "dataset"
    with pytest.MonkeyPatch.context() as patch:
        stopped(patch, module, name, calls, after=after)
        with claim(root, parse_recipe(TEXT, "test"), TEXT, kept=Kept.ARCHIVES) as dataset, pytest.raises(Stop):
            generate.run_shard(dataset, 0)
    assert {kind for _, kind in problems_of(root)} == {Kind.MISSING}
    assert cli("generate", made / "recipe.toml", "--out", root, "-q").code == 0
    assert content(root) == content(made / "packed")
    assert masters(root) == masters(made / "packed")
    assert len(rendered) == (5 if name == "write_linear" else 4)  # the second image was rendered and not written


def test_files_that_a_stop_left_beside_a_finished_shard_are_removed(made, packed, cli):
    shutil.copy(made / "single" / "masters" / "000001.exr", packed / "masters")
    other = shutil.copy(made / "single" / "masters" / "000001.exr", packed / "masters" / "000002.exr")
    assert problems_of(packed) == [("masters/000001.exr", Kind.UNPLANNED), ("masters/000002.exr", Kind.UNPLANNED)]
    assert cli("generate", made / "recipe.toml", "--out", packed, "-q").code == 0
    assert sorted(masters(packed)) == [FIRST, SECOND, "masters/000002.exr"]  # what is not packed is not removed
    assert cli("repair", packed, "-q").code == 0
    assert masters(packed) == masters(made / "packed")
    assert (packed / "quarantine" / "masters" / "000002.exr").read_bytes() == (
        made / "single" / "masters" / "000001.exr"
    ).read_bytes()
    assert not other.exists()


@pytest.mark.parametrize(
    "name", [name if name in OFTEN else pytest.param(name, marks=pytest.mark.full) for name in DAMAGES]
)
def test_what_is_damaged_is_found_and_made_again(name, made, packed, cli, rendered):
    damage, kind, again = DAMAGES[name]
    before = files(packed)
    damage(packed, made)
    damaged = (packed / FIRST).read_bytes() if (packed / FIRST).exists() else None
    rendered.clear()
    assert problems_of(packed) == [(FIRST, kind)]
    assert cli("repair", packed, "-q").code == 0
    assert len(rendered) == again
    assert problems_of(packed) == []
    after = files(packed)
    assert masters(packed) == masters(made / "packed")
    derived = {packed / name for name in (FIRST, "manifest.json", "README.md", ".known-shards.json")}
    assert {path for path, state in before.items() if after[path] != state} <= derived
    aside = packed / "quarantine" / FIRST
    assert (aside.read_bytes() if aside.exists() else None) == damaged


def test_exchanged_archives_and_those_of_no_shard(made, packed, cli):
    exchange(packed, made)
    (packed / "masters" / "000000-000003.zip").write_bytes(b"mine")
    found = [(FIRST, Kind.DAMAGED), (SECOND, Kind.DAMAGED), ("masters/000000-000003.zip", Kind.UNPLANNED)]
    assert problems_of(packed) == found
    done = cli("verify", packed)
    assert (done.code, len(done.err.splitlines())) == (2, 3)
    assert "is no archive of 000000.exr to 000001.exr and nothing else; `repair" in done.err.splitlines()[0]
    assert cli("repair", packed, "-q").code == 0
    assert masters(packed) == masters(made / "packed")


@pytest.mark.full
def test_an_archive_has_no_place_among_single_files(made, tmp_path, cli):
    root = tmp_path / "single"
    shutil.copytree(made / "single", root)
    shutil.copy(made / "packed" / FIRST, root / FIRST)
    (root / "masters" / "000000.exr").unlink()
    assert problems_of(root) == [("masters/000000.exr", Kind.MISSING), (FIRST, Kind.UNPLANNED)]
    assert cli("repair", root, "-q").code == 0
    assert masters(root) == masters(made / "single")


@pytest.mark.parametrize("source", [pytest.param("single", marks=pytest.mark.full), "packed"])
@pytest.mark.parametrize("options", [(), ("--pack-masters",)], ids=["to files", "to archives"])
def test_linear_light_is_taken_from_either_form(source, options, made, tmp_path, cli, rendered):
    root = tmp_path / "new"
    words = ("generate", made / "recipe.toml", "--out", root, "--reuse", made / source, "--regime", "harsh", *options)
    done = cli(*words)
    assert done.code == 0
    assert "4 of 4 taken" in done.out.replace("\n", " ")
    assert rendered == []
    assert masters(root) == masters(made / ("packed" if options else "single"))
    assert problems_of(root) == []
    if options and source == "packed":
        assert (root / FIRST).samefile(made / source / FIRST)  # as a whole


@pytest.mark.full
def test_damaged_light_is_not_taken(made, packed, tmp_path, cli, rendered):
    flip(0.25)(packed, made)
    words = ("generate", made / "recipe.toml", "--out", tmp_path / "new", "--reuse", packed, "--pack-masters")
    assert "3 of 4 taken" in cli(*words).out.replace("\n", " ")
    assert len(rendered) == 1
    assert masters(tmp_path / "new") == masters(made / "packed")


@pytest.fixture(params=["folder", pytest.param("s3", marks=pytest.mark.full)])
def stored(request, tmp_path):
    """A place in a store: of its kind in a folder, or on an S3 server."""
    if request.param == "folder":
        return UrlPath("file:", *(tmp_path / "store" / "demo").parts[1:])
    return dataset_folder(f"s3://a:b@bucket/packed/demo?{request.getfixturevalue('server')}")


def test_it_is_made_and_mended_at_a_url(made, stored, content):
    execution = Execution(LocalEngine(), Console(quiet=True))
    for name in ("000000.exr", "000001.exr"):
        copy_file(made / "single" / "masters" / name, stored / "masters" / name)
    copy_file(made / "packed" / RECIPE_FILE, stored / RECIPE_FILE)
    copy_file(made / "packed" / PACKED, stored / PACKED)
    with claim(stored, parse_recipe(TEXT, "test"), TEXT, kept=Kept.ARCHIVES) as dataset:
        stages.run_generate(dataset, execution)
    assert content(stored) == content(made / "packed")
    assert masters(stored) == masters(made / "packed")
    data = bytearray((stored / FIRST).read_bytes())
    data[len(data) // 4] ^= 4
    write_bytes(stored / FIRST, bytes(data))
    assert [item.kind for item in verify(dataset)[1]] == [Kind.DAMAGED]
    aside, left = repair(dataset, execution)
    assert ([path.read_bytes() for path in aside], left) == ([data], [])
    assert masters(stored) == masters(made / "packed")


def test_it_is_put_into_a_store_and_fetched(made, packed, tmp_path, cli):
    url = f"file://{tmp_path}/store/demo"
    assert cli("upload", packed, url).code == 0
    assert cli("download", url, tmp_path / "fetched").code == 0
    assert masters(tmp_path / "fetched") == masters(packed)
    assert problems_of(tmp_path / "fetched") == []
    assert "all 2 shards" in cli("generate", made / "recipe.toml", "--out", tmp_path / "fetched", "--pack-masters").out


def test_packing_again_changes_nothing(packed):
    before = files(packed)
    pack_masters(packed, range(2))
    assert files(packed) == before


@pytest.mark.full
@pytest.mark.parametrize("number", range(MOMENTS))
def test_a_run_that_is_killed_at_any_moment_goes_on(number, made, tmp_path, cli, content):
    root = tmp_path / "dataset"
    words = ["generate", made / "recipe.toml", "--out", root, "--pack-masters", "-q", "--workers", 1 + number % 2]
    running = subprocess.Popen([sys.executable, "-m", "pipelines", *map(str, words)], start_new_session=True)
    rng, deadline = random.Random(number), time.monotonic() + 60.0
    while not (root / "masters").is_dir() and running.poll() is None and time.monotonic() < deadline:
        pass
    time.sleep(rng.uniform(0.0, 0.3))
    os.killpg(running.pid, signal.SIGKILL)
    running.wait()
    assert {kind for _, kind in problems_of(root)} <= {Kind.MISSING}
    assert cli("generate", made / "recipe.toml", "--out", root, "-q").code == 0
    assert content(root) == content(made / "packed")
    assert masters(root) == masters(made / "packed")
