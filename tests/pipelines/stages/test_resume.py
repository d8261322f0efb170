"""The same recipe gives the same content, however often, in whatever order and by however many workers."""

from __future__ import annotations

import errno
import shutil

import pytest

from datasets.store.dataset import open_dataset
from pipelines.stages import generate
from tests.timeless import timeless

STAGE = {
    "frames": "generate",
    "keypoints": "generate",
    "detections": "detect",
    "estimates": "estimate",
    "scores": "score",
}


@pytest.fixture
def copy(tiny, tmp_path):
    """Recipe file and folder of a copy of the tiny dataset."""
    text, source = tiny
    root = tmp_path / "dataset"
    shutil.copytree(source, root)
    recipe = tmp_path / "tiny.toml"
    recipe.write_text(text)
    return recipe, root


@pytest.fixture
def no_rendering(monkeypatch):
    def refuse(*_, **__):
        raise AssertionError("rendered again")

    monkeypatch.setattr(generate, "render_world", refuse)


def first(root, folder):
    return min((root / folder).iterdir())


def made(root):
    """Identity and time of every file that a stage made, the derived texts left out."""
    found = (*root.rglob("*.parquet"), *root.rglob("*.exr"))
    return {path: (path.stat().st_ino, path.stat().st_mtime_ns) for path in found}


@pytest.mark.usefixtures("no_report")
def test_the_same_recipe_twice_gives_the_same_content(tiny, copy, tmp_path, cli, content):
    assert cli("run", copy[0], "--out", tmp_path / "again").code == 0
    assert content(tmp_path / "again") == content(tiny[1])


def test_two_workers_give_the_same_pictures(copy, tmp_path, cli, content):
    recipe, once = copy
    assert cli("generate", recipe, "--out", tmp_path / "twice", "--workers", 2).code == 0
    for table in ("detections", "estimates", "scores"):
        shutil.rmtree(once / table)
    open_dataset(once).write_manifest()
    assert content(tmp_path / "twice") == content(once)


@pytest.mark.full
def test_two_workers_give_the_same_detections(copy, cli, content):
    _, root = copy
    before = content(root)
    shutil.rmtree(root / "detections")
    assert cli("detect", root, "--workers", 2).code == 0
    assert content(root) == before


@pytest.mark.usefixtures("no_report")
def test_a_finished_dataset_is_left_alone(copy, cli, no_rendering):
    recipe, root = copy
    before = made(root)
    assert cli("run", recipe, "--out", root).code == 0
    assert made(root) == before


@pytest.mark.parametrize("table", STAGE)
@pytest.mark.parametrize(
    "change",
    [pytest.param(lambda data: None, marks=pytest.mark.full), lambda data: data[: len(data) // 2]],
    ids=["gone", "truncated"],
)
def test_a_shard_that_is_not_sound_is_made_again(table, change, tiny, copy, cli, content):
    recipe, root = copy
    path = first(root, table)
    before, data = made(root), change(path.read_bytes())
    path.unlink() if data is None else path.write_bytes(data)
    where = (recipe, "--out", root) if STAGE[table] == "generate" else (root,)
    assert cli(STAGE[table], *where).code == 0
    assert content(root) == content(tiny[1])
    assert {path for path, found in made(root).items() if found != before[path]} == {path}


@pytest.mark.parametrize(
    "change",
    [lambda data: data, pytest.param(lambda data: data[: len(data) // 2], marks=pytest.mark.full)],
    ids=["whole", "half"],
)
def test_what_a_killed_run_left_is_no_shard_and_is_swept(change, tiny, copy, cli, content):
    recipe, root = copy
    left = [root / ".tmp-7-recipe.toml", root / "masters" / ".tmp-7-000000.exr"]
    left[0].write_text("name")
    left[1].write_bytes(b"")
    for table in STAGE:
        path = first(root, table)
        left.append(path.with_name(f".tmp-7-{path.name}"))
        left[-1].write_bytes(change(path.read_bytes()))
    assert content(root) == content(tiny[1])
    assert open_dataset(root).read("frames").num_rows == 2
    shutil.rmtree(root / "scores")
    assert cli("score", root).code == 0
    assert content(root) == content(tiny[1])
    assert cli("generate", recipe, "--out", root).code == 0
    assert [path for path in left if path.exists()] == []
    assert content(root) == content(tiny[1])


def test_a_frame_is_developed_again_without_being_rendered(tiny, copy, cli, content, no_rendering):
    recipe, root = copy
    shutil.rmtree(root / "frames")
    masters = {path: found for path, found in made(root).items() if path.suffix == ".exr"}
    assert cli("generate", recipe, "--out", root).code == 0
    assert {path: found for path, found in made(root).items() if path.suffix == ".exr"} == masters
    assert content(root) == content(tiny[1])


def test_a_master_of_another_frame_is_not_developed(copy, cli, no_rendering):
    recipe, root = copy
    shutil.rmtree(root / "frames")
    shutil.copy(root / "masters" / "000000.exr", root / "masters" / "000001.exr")
    done = cli("generate", recipe, "--out", root)
    assert done.code == 75
    assert "rendered again" in done.err


def test_a_new_estimate_renders_and_detects_nothing(copy, cli, no_rendering):
    _, root = copy
    before = made(root)
    assert cli("estimate", root, "--points", "truth+noise", "--draws", 2, "--solver", "centred").code == 0
    assert cli("score", root).code == 0
    after = made(root)
    assert before.items() <= after.items()
    assert len(after) == len(before) + 4


def test_the_content_tells_datasets_apart(tiny, copy, cli, content, tmp_path):
    recipe, _ = copy
    recipe.write_text(tiny[0].replace("seed = 5", "seed = 6"))
    assert cli("generate", recipe, "--out", tmp_path / "other").code == 0
    recipe.write_text(tiny[0])
    assert cli("generate", recipe, "--out", tmp_path / "same").code == 0
    assert content(tmp_path / "other") != content(tmp_path / "same")


def test_a_missing_master_is_rendered_again(copy, cli, content):
    recipe, root = copy
    before = content(root)
    lost = first(root, "masters")
    lost.unlink()
    assert cli("verify", root).code == 2
    assert cli("generate", recipe, "--out", root).code == 0
    assert lost.is_file()
    assert content(root) == before


def test_a_lost_manifest_is_made_again(copy, cli):
    recipe, root = copy
    before = timeless(root / "manifest.json")
    (root / "manifest.json").unlink()
    assert cli("generate", recipe, "--out", root).code == 0
    assert timeless(root / "manifest.json") == before


def test_a_noisy_regime_needs_no_rendering_and_has_the_same_bits_in_any_order(tiny, copy, tmp_path, cli, content):
    recipe, _ = copy
    noisy = tmp_path / "noisy"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(generate, "render_world", lambda *_, **__: pytest.fail("rendered again"))
        done = cli("generate", recipe, "--out", noisy, "--regime", "harsh", "--reuse", tiny[1])
    assert done.code == 0
    assert "2 of 2 taken from" in done.out.replace("\n", " ")
    before = content(noisy)
    assert before != content(tiny[1])
    assert 'regime = "harsh"' in (noisy / "recipe.toml").read_text()
    first(noisy, "frames").unlink()  # the first shard after the second
    assert cli("generate", noisy / "recipe.toml", "--out", noisy).code == 0
    assert content(noisy) == before
    alone = tmp_path / "alone"
    assert cli("generate", noisy / "recipe.toml", "--out", alone).code == 0
    assert content(alone) == before


def test_only_masters_of_the_same_views_are_taken(tiny, copy, tmp_path, cli, content):
    recipe, root = copy
    lost, kept = sorted((root / "masters").iterdir())
    lost.write_bytes(kept.read_bytes())  # a whole master, of another frame
    recipe.write_text(tiny[0].replace("stop = 90", "stop = 180"))  # one view more
    done = cli("generate", recipe, "--out", tmp_path / "more", "--reuse", root)
    assert done.code == 0
    assert "1 of 3 taken from" in done.out.replace("\n", " ")
    assert cli("generate", recipe, "--out", tmp_path / "alone").code == 0
    assert content(tmp_path / "more") == content(tmp_path / "alone")


def test_masters_are_copied_where_no_link_is_possible(tiny, copy, tmp_path, cli, monkeypatch, no_rendering):
    def refuse(*_):
        raise OSError(errno.EXDEV, "another disk")

    monkeypatch.setattr("os.link", refuse)
    assert cli("generate", copy[0], "--out", tmp_path / "other", "--reuse", tiny[1], "--regime", "typical").code == 0
    assert {path.stat().st_nlink for path in (tmp_path / "other" / "masters").iterdir()} == {1}
