"""`verify` finds what is deleted, exchanged, foreign, doctored or not planned, one line for each file."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pyarrow as pa
import pytest

from datasets.store.dataset import open_dataset
from datasets.verify import verify
from datasets.verify.problems import Kind
from tests.tables import OF_A_RUN
from tests.wrong_input import doctor, first


def problems_of(root):
    """Place and kind of what `verify` finds."""
    return [(item.path.relative_to(root).as_posix(), item.kind) for item in verify(open_dataset(root))[1]]


def swap(one, other):
    data = one.read_bytes()
    one.write_bytes(other.read_bytes())
    other.write_bytes(data)


def place(root, path):
    return path.relative_to(root).as_posix()


@pytest.mark.parametrize("table", OF_A_RUN)
def test_a_deleted_shard(table, root):
    path = first(root, table)
    path.unlink()
    assert problems_of(root) == [(place(root, path), Kind.MISSING)]


@pytest.mark.parametrize("table", OF_A_RUN)
def test_exchanged_shards(table, root):
    one, other = sorted((root / table).iterdir())[:2]
    swap(one, other)
    assert problems_of(root) == [(place(root, one), Kind.FOREIGN), (place(root, other), Kind.FOREIGN)]


@pytest.mark.parametrize("table", ["detections", "estimates", "scores"])
def test_a_kind_of_rows_that_is_deleted_as_a_whole_is_known_from_the_manifest(table, root):
    lost = sorted((root / table).iterdir())
    shutil.rmtree(root / table)
    assert problems_of(root) == [(place(root, path), Kind.MISSING) for path in lost]


def test_masters_that_are_exchanged_deleted_or_too_many(root):
    one, other = sorted((root / "masters").iterdir())
    swap(one, other)
    extra = root / "masters" / "000007.exr"
    extra.write_bytes(one.read_bytes())
    found = [(one, Kind.FOREIGN), (other, Kind.FOREIGN), (extra, Kind.UNPLANNED)]
    assert problems_of(root) == [(place(root, path), kind) for path, kind in found]
    extra.unlink()
    swap(one, other)
    other.unlink()
    assert problems_of(root) == [(place(root, other), Kind.MISSING)]


def test_a_file_that_other_readers_would_take_for_rows(root):
    path = root / "scores" / "mine.parquet"
    path.write_bytes(first(root, "scores").read_bytes())
    assert problems_of(root) == [(place(root, path), Kind.UNPLANNED)]


def test_a_shard_of_another_count(root):
    path = first(root, "scores")
    shutil.copy(path, path.with_name(path.name.replace("-of-00002", "-of-00007")))
    kinds = dict(problems_of(root))
    assert kinds["scores/best-detected-exact-all-00000-of-00007.parquet"] == Kind.FOREIGN


@pytest.mark.parametrize("column", ["t_x_mm", "q_w", "fx_px", "sensor_seed", "camera_name", "pose_id"])
def test_a_frame_whose_truth_is_not_the_plans(column, root):
    def change(rows):
        at = rows.column_names.index(column)
        value = rows.column(at).to_pylist()[0]
        values = [f"{value}x" if isinstance(value, str) else type(value)(value * 1.01 + 1)]
        return rows.set_column(at, rows.schema.field(at), pa.array(values, rows.schema.field(at).type))

    path = first(root, "frames")
    doctor(path, change)
    assert (place(root, path), Kind.DAMAGED) in problems_of(root)


def test_keypoints_that_are_not_where_the_plan_has_them(root):
    def change(rows):
        at = rows.column_names.index("x_px")
        values = np.array(rows.column(at).to_pylist())
        values[3] += 0.01
        return rows.set_column(at, rows.schema.field(at), pa.array(values))

    path = first(root, "keypoints")
    doctor(path, change)
    assert problems_of(root) == [(place(root, path), Kind.DAMAGED)]


@pytest.mark.parametrize("table", OF_A_RUN)
def test_rows_that_lack_or_stand_in_another_order(table, root, cli):
    path = first(root, table)
    orders = [lambda rows: rows.slice(1), lambda rows: pa.concat_tables([rows, rows.slice(0, 1)])]
    data = path.read_bytes()
    for order in orders:
        path.write_bytes(data)
        doctor(path, order)
        found = dict(problems_of(root))
        if table in ("estimates", "scores") and order is orders[1]:
            assert found[place(root, path)] in (Kind.DAMAGED, Kind.CHANGED)  # as many rows as of two draws
        else:
            assert found[place(root, path)] == Kind.DAMAGED


def test_another_recipe_is_one_problem(root):
    path = root / "recipe.toml"
    path.write_text(path.read_text().replace("seed = 5", "seed = 6"))
    assert problems_of(root) == [("recipe.toml", Kind.CHANGED)]


@pytest.mark.parametrize("text", ["{", "[1]", '{"shards": []}', "[" * 100_000])
def test_a_manifest_that_is_none(text, root):
    (root / "manifest.json").write_text(text)
    assert problems_of(root) == [("manifest.json", Kind.DAMAGED)]


def test_a_line_for_each_problem_and_the_exit_code(root, cli):
    for table in ("scores", "masters"):
        first(root, table).unlink()
    done = cli("verify", root)
    lines = done.err.splitlines()
    assert (done.code, done.out) == (2, "")
    assert [line.startswith("error: ") for line in lines] == [True, True]
    told = json.loads(cli("verify", root, "--json").out)["problems"]
    assert [f"error: {item['text']}" for item in told] == lines
    assert {item["kind"] for item in told} == {"missing"}


def test_unchecked_reading_is_asked_for(root):
    """The switch for who has just checked: a changed value is read as it is, and the next reader is told."""
    path = first(root, "scores")
    whole = open_dataset(root).read_shard(path)
    data = bytearray(path.read_bytes())
    doctor(path, lambda rows: rows.slice(0, 0))
    assert open_dataset(root, check=False).read_shard(path).num_rows == 0
    path.write_bytes(data)
    assert open_dataset(root, check=False).read_shard(path).equals(whole)
