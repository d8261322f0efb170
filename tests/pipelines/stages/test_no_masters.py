"""Without linear images the content is the same, and what needs them says so."""

from __future__ import annotations

import pytest

from datasets.store.dataset import open_dataset
from datasets.store.kept_masters import NOT_KEPT
from tests.wrong_input import assert_one_sentence, files, first


def masters(root):
    return sorted(path.name for path in (root / "masters").glob("*"))


@pytest.fixture
def bare(place, cli):
    """Recipe file and folder of a dataset without linear images."""
    recipe, root = place.recipe(), place.new()
    assert cli("generate", recipe, "--out", root, "--no-masters", "-q").code == 0
    return recipe, root


@pytest.mark.usefixtures("no_figures")
def test_the_content_is_that_of_a_dataset_with_them(place, bare, cli, content):
    recipe, root = bare
    assert masters(root) == []
    kept = place.dataset(without=["detections", "estimates", "scores"])
    assert content(root) == content(kept)  # verified: nothing is missing
    assert "Linear images were not kept" in (root / "README.md").read_text()
    assert cli("generate", recipe, "--out", kept, "-q").code == 0
    assert "Linear images were not kept" not in (kept / "README.md").read_text()
    assert cli("detect", root, "-q").code == 0
    assert cli("estimate", root, "-q").code == 0
    assert cli("score", root, "-q").code == 0
    assert cli("report", root).code == 0


@pytest.mark.full
@pytest.mark.parametrize("again", [(), ("--no-masters",)], ids=["as it began", "told again"])
@pytest.mark.parametrize("workers", [1, 2])
def test_it_is_resumed_as_it_began(again, workers, bare, cli, content):
    recipe, root = bare
    before, text = content(root), files(root)[root / NOT_KEPT]
    assert "all 2 shards are there" in cli("generate", recipe, "--out", root, *again).out
    for path in (root / "frames").iterdir():
        path.unlink()
    first(root, "keypoints").write_bytes(b"")
    done = cli("generate", recipe, "--out", root, *again, "--workers", workers)
    assert done.code == 0
    assert ("not kept" in done.out) == (not again)
    assert content(root) == before
    assert masters(root) == []
    assert files(root)[root / NOT_KEPT] == text


def test_it_has_nothing_to_reuse(place, bare, cli, tmp_path):
    recipe, root = bare
    done = cli("generate", recipe, "--out", tmp_path / "other", "--reuse", root)
    assert_one_sentence(done.code, done.err, "was made with --no-masters and has no linear images")
    assert not (tmp_path / "other").exists()


def test_it_reuses_those_of_others_and_keeps_none(place, cli, content, tmp_path, monkeypatch):
    from pipelines.stages import generate

    monkeypatch.setattr(generate, "render_world", lambda *_, **__: pytest.fail("rendered again"))
    source = place.dataset(without=["detections", "estimates", "scores"])
    before = files(source)
    words = ("generate", place.recipe(), "--out", place.new(), "--reuse", source, "--no-masters")
    assert "2 of 2 taken" in cli(*words).out.replace("\n", " ")
    assert masters(place.new()) == []
    assert content(place.new()) == content(source)
    first(place.new(), "frames").unlink()
    assert "1 of 1 taken" in cli(*words).out.replace("\n", " ")  # only what is still to be developed
    assert masters(place.new()) == []
    assert files(source) == before


def test_what_is_kept_stays_kept(place, cli):
    recipe, root = place.recipe(), place.dataset()
    before = files(root)
    done = cli("generate", recipe, "--out", root, "--no-masters")
    assert_one_sentence(
        done.code, done.err, "keeps its linear images as single files; leave out --no-masters, or choose another --out"
    )
    assert before.items() <= files(root).items()
    assert not (root / NOT_KEPT).exists()


def test_a_run_that_was_killed_before_its_first_frame_goes_on_without(place, cli):
    """It had bound the folder to the recipe, and no more."""
    place.new().mkdir()
    (place.new() / "recipe.toml").write_text(place.text)
    assert cli("generate", place.recipe(), "--out", place.new(), "--no-masters", "-q").code == 0
    assert masters(place.new()) == []
    assert open_dataset(place.new()).read("frames").num_rows == 2


@pytest.mark.full
@pytest.mark.usefixtures("no_report")
def test_run_takes_the_option_too(place, cli):
    assert cli("run", place.recipe(), "--out", place.new(), "--no-masters", "-q").code == 0
    assert masters(place.new()) == []
    assert cli("verify", place.new()).code == 0
