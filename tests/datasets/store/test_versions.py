"""A dataset of an earlier version is read as it is; one of a later version is left alone."""

from __future__ import annotations

import shutil

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from datasets.store.dataset import open_dataset
from datasets.store.images import encode_png
from tests.conftest import command
from tests.old_dataset import NEW, make_old
from tests.tables import OF_A_RUN
from tests.wrong_input import Place, assert_one_sentence, files, first, put_image

UNSUPPORTED = "has schema version 9, and this program reads 2 and 3; use the program that wrote it"


@pytest.fixture(scope="module")
def originals(tiny, tmp_path_factory):
    """A dataset of today with a failed frame, and the same as version 2 wrote it; no test may change them."""
    place = Place(tmp_path_factory.mktemp("versions"), *tiny, None)
    new = place.dataset(without=["detections", "estimates", "scores"])
    put_image(new, encode_png(np.full((300, 400), 90, np.uint8)))  # no board in it
    path = first(new, "frames")
    dataset = open_dataset(new)
    dataset.write_shard(path, dataset.read_shard(path))
    for words in (("detect",), ("estimate",), ("estimate", "--solver", "eposit", "--use", "four"), ("score",)):
        assert command(words[0], new, *words[1:], "-q") == 0
    assert command("report", new) == 0
    old = new.with_name("old")
    shutil.copytree(new, old)
    make_old(old)
    open_dataset(old).write_manifest()
    return new, old


@pytest.fixture
def both(originals, tmp_path):
    """Copies of them."""
    copies = tuple(tmp_path / path.name for path in originals)
    for path, copied in zip(originals, copies, strict=True):
        shutil.copytree(path, copied)
    return copies


def test_rows_are_those_of_today(both):
    new, old = map(open_dataset, both)
    assert np.isnan(pq.read_table(new.root / "scores")["rotation_error_deg"].to_numpy()).any()
    assert pq.read_table(old.root / "scores")["rotation_error_deg"].null_count == 0
    for table, schema in OF_A_RUN.items():
        rows = old.read(table)
        assert rows.schema.equals(schema)
        same = [name for name in schema.names if not (table == "scores" and name in NEW)]
        assert rows.select(same).equals(new.read(table).select(same))
    scores = old.read("scores")
    assert set(scores["failure_reason"].to_pylist()) == {None, "points_missing"}
    assert scores["distance_mm"].null_count == scores.num_rows
    assert not pc.any(pc.is_nan(scores["rotation_error_deg"])).as_py()


def test_some_columns_of_old_rows(both):
    old = open_dataset(both[1])
    assert old.read("scores", ["tilt_deg", "status"]).column_names == ["tilt_deg", "status"]
    assert old.read("scores", ["failure_reason"]).column_names == ["failure_reason"]
    assert old.read("frames", ["tilt_deg"])["tilt_deg"].null_count == 0


def shards(root):
    """Content and time of every shard."""
    return {path: found for path, found in files(root).items() if path.suffix == ".parquet"}


def test_reading_commands_change_no_shard(both, cli):
    new, old = both
    before = shards(old)
    for name in ("detect", "estimate", "score", "verify", "report"):
        assert cli(name, old).code == 0, name
    assert shards(old) == before
    assert (old / "report.html").read_bytes() == (new / "report.html").read_bytes()


def test_old_estimates_are_scored_as_today(both, cli):
    new, old = both
    for path in (old / "scores").iterdir():
        path.unlink()
    before = shards(old)
    assert cli("score", old).code == 0
    assert before.items() <= shards(old).items()
    assert open_dataset(old).read("scores").equals(open_dataset(new).read("scores"))
    assert cli("verify", old).code == 0


@pytest.mark.usefixtures("no_figures")
def test_shards_of_both_versions_stand_beside_each_other(both, cli):
    _, old = both
    first(old, "scores").unlink()
    before = shards(old)
    for name in ("score", "verify", "report"):
        assert cli(name, old).code == 0, name
    assert before.items() <= shards(old).items()
    assert len({pq.read_schema(path).metadata[b"schema_version"] for path in (old / "scores").iterdir()}) == 2


def test_a_changed_value_in_an_old_shard_is_found(both, cli):
    _, old = both
    path = max((old / "scores").iterdir())
    rows = pq.read_table(path)
    place = rows.column_names.index("tx_error_mm")
    changed = rows.set_column(place, rows.schema.field(place), pa.array(rows.column(place).to_numpy() + 1.0))
    pq.write_table(changed.replace_schema_metadata(rows.schema.metadata), path)
    done = cli("verify", old)
    assert_one_sentence(done.code, done.err, "do not match the hash")


@pytest.fixture
def old_default(place, cli, monkeypatch):
    """A recipe without `shard_frames`, and its dataset as version 2 began it: ten frames in a shard."""
    text = place.text.replace("shard_frames = 1\n", "")
    given = place.recipe(place.text.replace("shard_frames = 1", "shard_frames = 10"))
    root = place.new()
    assert cli("generate", given, "--out", root, "--reuse", place.source, "-q").code == 0
    (root / "recipe.toml").write_text(text)
    make_old(root)
    (root / "manifest.json").unlink()
    monkeypatch.setattr("datasets.plan.shards.LEAST_SHARD_FRAMES", 1)  # today's default cuts two frames into two shards
    return place.recipe(text), root


def test_a_recipe_that_relied_on_the_old_default_goes_on(old_default, cli, tmp_path):
    recipe, root = old_default
    before = shards(root)
    assert len(before) == 2
    assert cli("verify", root).code == 0
    assert "all 1 shards are there" in cli("generate", recipe, "--out", root).out
    assert cli("detect", root, "-q").code == 0
    first(root, "keypoints").unlink()
    assert cli("generate", recipe, "--out", root, "-q").code == 0
    names = sorted(path.name for path in shards(root))
    assert names == [f"{table}-00000-of-00001.parquet" for table in ("detections", "frames", "keypoints")]
    first(root, "frames").write_bytes(b"")  # the other tables still tell
    assert cli("generate", recipe, "--out", root, "-q").code == 0
    assert cli("verify", root).code == 0
    assert sorted(path.name for path in shards(root)) == names
    assert cli("generate", recipe, "--out", tmp_path / "begun", "--reuse", root, "-q").code == 0
    assert len(shards(tmp_path / "begun")) == 4


@pytest.mark.parametrize("table", OF_A_RUN)
def test_a_version_that_is_not_known_is_one_sentence_and_stays(table, place, cli):
    root = place.dataset()
    path = first(root, table)
    rows = pq.read_table(path)
    pq.write_table(rows.replace_schema_metadata(rows.schema.metadata | {b"schema_version": b"9"}), path)
    before = shards(root)
    for words in (("generate", place.recipe(), "--out", root), ("detect", root), ("estimate", root), ("score", root)):
        done = cli(*words)
        assert done.code == 0 or UNSUPPORTED in done.err
    done = cli("verify", root)
    assert_one_sentence(done.code, done.err, UNSUPPORTED)
    assert shards(root) == before


def test_a_dataset_that_was_cut_by_an_earlier_rule_goes_on(place, cli, monkeypatch):
    recipe, root = place.recipe(place.text.replace("shard_frames = 1\n", "")), place.new()
    with monkeypatch.context() as earlier:
        earlier.setattr("datasets.plan.shards.LEAST_SHARD_FRAMES", 1)
        assert cli("generate", recipe, "--out", root, "--reuse", place.source, "-q").code == 0
    names = sorted(path.name for path in shards(root))
    assert len(names) == 4
    assert cli("verify", root).code == 2  # today's rule makes one shard of two frames
    monkeypatch.setattr("datasets.store.versions.OLD_MOST_SHARD_FRAMES", 1)
    assert "all 2 shards are there" in cli("generate", recipe, "--out", root).out
    assert cli("detect", root, "-q").code == 0
    assert cli("verify", root).code == 0
    assert len(shards(root)) == 6
