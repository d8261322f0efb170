"""Each reader is given what hypothesis thinks of: an answer or the reader's own error, nothing else.

`FUZZ_SECONDS=600 python -m pytest -m slow tests/hostile/test_fuzz.py` fuzzes each reader for ten minutes, beside what a
test takes to set up, and tells the number of examples, also when SIGTERM ends it.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest
from hypothesis import strategies as st

from datasets.errors import UserError
from datasets.recipe.model import parse_recipe
from datasets.store.dataset import open_dataset
from datasets.store.exr_file import DamagedExrError, read_exr, write_exr
from datasets.store.images import decode_pixels, encode_png
from datasets.store.linear_images import LinearImageError, read_linear
from datasets.store.shard_file import read_rows
from datasets.store.zip_archive import DamagedArchiveError, check_layout, read_member, write_archive
from pipelines.report.page import write_report
from pipelines.stages.import_poses import read_poses
from tests.conftest import TINY
from tests.hostile.fuzzing import fuzz as fuzz
from tests.hostile.kinds.tables import write
from tests.wrong_input import first

KEYS = [line.split(" = ")[0] for line in TINY.splitlines() if " = " in line]
PNG = encode_png(np.random.default_rng(0).integers(0, 256, (30, 40)).astype(np.uint8))
COLUMNS = ("frame_id", "q_w", "q_x", "q_y", "q_z", "tx", "ty", "tz", "t_x_mm", "t_y_mm", "t_z_mm", "r11", "status")


def _edits(data):
    """Bytes with some of them replaced, taken out or put in."""
    edit = st.tuples(st.integers(0, len(data)), st.integers(0, 8), st.binary(max_size=8))

    def made(edits):
        changed = data
        for at, count, put in edits:
            changed = changed[:at] + put + changed[at + count :]
        return changed

    return st.one_of(st.binary(max_size=300), st.lists(edit, min_size=1, max_size=4).map(made))


def _chunk(name, data):
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


SIZES = st.sampled_from([0, 1, 2, 40, 5000, 2**31 - 1, 2**32 - 1])
HEADERS = st.builds(lambda w, h, rest: struct.pack(">II", w, h) + rest, SIZES, SIZES, st.binary(min_size=5, max_size=5))
CHUNKS = st.tuples(
    st.sampled_from([b"IDAT", b"PLTE", b"tRNS", b"zTXt", b"iCCP", b"acTL", b"eXIf"]), st.binary(max_size=60)
)
PICTURES = st.one_of(
    _edits(PNG),
    st.builds(
        lambda header, chunks: PNG[:8] + _chunk(b"IHDR", header) + b"".join(_chunk(*c) for c in chunks),
        HEADERS,
        st.lists(CHUNKS, max_size=5),
    ),
)
TOML_VALUES = st.one_of(
    st.integers(),
    st.floats(),
    st.text(max_size=20).map(repr),
    st.booleans().map(lambda b: str(b).lower()),
    st.lists(st.one_of(st.integers(), st.floats()), max_size=4),
)
RECIPES = st.one_of(
    st.text(max_size=400),
    _edits(TINY.encode()).map(lambda data: data.decode("utf-8", "replace")),
    st.builds(lambda key, value: TINY.replace(f"{key} =", f"{key} = {value} #"), st.sampled_from(KEYS), TOML_VALUES),
    st.builds(
        lambda section, line, value: f"{TINY}\n[{section}]\n{line} = {value}\n",
        st.sampled_from(["target", "light", "sensor", "world", "optics", "outputs"]),
        st.text("abcdefm_", max_size=9),
        TOML_VALUES,
    ),
)
NUMBERS = st.one_of(
    st.floats().map(str), st.integers().map(str), st.text(max_size=12), st.sampled_from(["", "0", "1", "nan"])
)
POSES = st.one_of(
    st.binary(max_size=300),
    st.builds(
        lambda header, rows: "\n".join(",".join(row) for row in [header, *rows]).encode("utf-8", "replace"),
        st.one_of(st.just(list(COLUMNS[:8])), st.lists(st.sampled_from(COLUMNS), max_size=13)),
        st.lists(st.lists(NUMBERS, min_size=8, max_size=8), max_size=4),
    ),
)


def test_recipes(fuzz):
    fuzz(RECIPES, lambda text: parse_recipe(text, "recipe"), UserError)


def test_pictures(fuzz, capfd):
    fuzz(PICTURES, decode_pixels, ValueError)
    assert capfd.readouterr().err == ""


def test_poses(fuzz, tmp_path):
    path = tmp_path / "poses.csv"

    def read(data):
        path.write_bytes(data)
        read_poses(path)

    fuzz(POSES, read, UserError)


def test_linear_images(fuzz, tmp_path):
    path = tmp_path / "a.exr"
    window = np.array([0, 0], np.int32), np.array([7, 5], np.int32)
    header = {"key": "k", "background": 0.25, "dataWindow": window, "displayWindow": window}
    write_exr(path, header, {"Y": np.ones((6, 8), np.float32)})

    def read(data):
        path.write_bytes(data)
        read_exr(path)
        read_linear(path, "k")

    fuzz(_edits(path.read_bytes()), read, (DamagedExrError, LinearImageError, OSError))


def test_archives(fuzz, tmp_path):
    path, names = tmp_path / "a.zip", ["000000.exr", "000001.exr"]
    write_archive(path, names, [b"one", b"other"])

    def read(data):
        path.write_bytes(data)
        check_layout(path, names)
        assert [read_member(path, names, number) for number in range(2)] == [b"one", b"other"]

    fuzz(_edits(path.read_bytes()), read, DamagedArchiveError)


@pytest.mark.parametrize("table", ["frames", "detections", "scores"])
def test_tables(table, fuzz, root):
    dataset = open_dataset(root)
    path: Path = first(root, table)

    def read(data):
        path.write_bytes(data)
        dataset.read_shard(path)

    fuzz(_edits(path.read_bytes()), read, UserError)


CELLS = st.one_of(st.none(), st.booleans(), st.floats(), st.integers(), st.text(max_size=20), st.binary(max_size=20))
CHANGES = st.lists(
    st.tuples(
        st.sampled_from(["frames", "keypoints", "detections", "estimates", "scores"]),
        st.integers(0, 60),  # column
        st.one_of(st.none(), st.integers(0, 20)),  # row; every one
        CELLS,
    ),
    min_size=1,
    max_size=3,
)


def _changed(rows, column, row, value):
    """A table with another value in a column, in one row or in all; null where the column cannot hold it."""
    index = column % rows.num_columns
    values = rows.column(index).to_pylist()
    values = [value if row is None or i == row % len(values) else old for i, old in enumerate(values)]
    field = rows.schema.field(index).with_nullable(True)
    try:
        array = pa.array(values, field.type)
    except (pa.ArrowException, OverflowError, ValueError, TypeError):
        array = pa.nulls(len(values), field.type)
    return rows.set_column(index, field, array)


def test_inputs_of_the_report(fuzz, root):
    """Tables with right digests and wrong values."""
    paths = {table: first(root, table) for table in ("frames", "keypoints", "detections", "estimates", "scores")}
    sound = {path: path.read_bytes() for path in paths.values()}
    rows = {path: read_rows(path) for path in sound}

    def report(changes):
        for path, data in sound.items():
            path.write_bytes(data)
        for table, column, row, value in changes:
            path = paths[table]
            metadata = rows[path].schema.metadata
            footer = {key.decode(): text.decode() for key, text in metadata.items()}
            write(path, _changed(read_rows(path).replace_schema_metadata(None), column, row, value), footer)
        write_report(open_dataset(root))

    fuzz(CHANGES, report, UserError, examples=2)
