"""Parquet tables with right footers and digests and wrong content, through every stage to the report."""

from __future__ import annotations

import json
import random
import shutil
from collections.abc import Callable
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from datasets.schema import TABLES
from datasets.store.digest import column_digest, table_digest, text_digest
from datasets.store.shard_file import (
    CHECKS_KEY,
    DIGEST_KEY,
    MEANINGS_KEY,
    PLACE_KEY,
    RECIPE_KEY,
    VERSION_KEY,
    read_rows,
)
from tests.hostile.running import Call
from tests.hostile.values import FLOATS, TEXTS, WHOLE, damaged
from tests.wrong_input import Place

OF_A_RUN = ("frames", "keypoints", "detections", "estimates", "scores")
AFTER = {"frames": 2, "keypoints": 2, "detections": 3, "estimates": 4, "scores": 5}  # of OF_A_RUN, made again from it
TEXT_LIMIT = 2000


def make(rng: random.Random, place: Place) -> tuple[str, list[Call]]:
    """A dataset with one shard doctored, and all that reads it."""
    root = place.dataset()
    table = rng.choice(OF_A_RUN)
    path = rng.choice(sorted((root / table).glob("*.parquet")))
    footer = {key.decode(): value.decode() for key, value in (pq.read_metadata(path).metadata or {}).items()}
    rows = read_rows(path).replace_schema_metadata(None)
    what, changed = rng.choice((_values, _values, _values, _columns, _rows, _footer, _file))(rng, rows, footer, path)
    if changed is not None:
        write(path, changed, footer)
    for name in OF_A_RUN[AFTER[table] :]:
        shutil.rmtree(root / name)
    return f"{table}: {what}", _calls(rng, root, table)


def _calls(rng: random.Random, root: Path, table: str) -> list[Call]:
    stages: list[Call] = [("detect", root, "-q"), ("estimate", root, "-q"), ("score", root, "-q")]
    calls = stages[AFTER[table] - 2 :] if AFTER[table] < 5 else []
    calls.append(("report", root))
    if rng.random() < 0.3:
        calls.append(("verify", root, *rng.choice(((), ("--json",)))))
    if rng.random() < 0.2:
        calls.append(("compare", root, root))
    if rng.random() < 0.1:
        calls.append(("estimate", root, "-q", "--points", "truth+noise", "--draws", 2, "--use", "four"))
    return calls


def write(path: Path, rows: pa.Table, footer: dict[str, str]) -> None:
    """Rows of any columns as a shard whose digests fit, where they can be made."""
    told = {
        key: value
        for key, value in footer.items()
        if key.encode() in (RECIPE_KEY, VERSION_KEY, PLACE_KEY) or key in (MEANINGS_KEY, "huggingface", "more")
    }
    try:
        told[DIGEST_KEY.decode()] = table_digest(rows)
    except Exception:
        told[DIGEST_KEY.decode()] = footer.get(DIGEST_KEY.decode(), "")
    checks: list[str] = []
    for name, column in zip(rows.column_names, rows.columns, strict=True):
        try:
            checks.append(column_digest(name, column))
        except Exception:
            checks.append("x")
    checks.append(text_digest(json.dumps(sorted(told.items()))))
    with pq.ParquetWriter(
        path, rows.schema, compression="zstd", store_schema=False, write_page_checksum=True
    ) as writer:
        writer.write_table(rows)
        writer.add_key_value_metadata(told | {CHECKS_KEY.decode(): " ".join(checks)})


def _values(rng: random.Random, rows: pa.Table, footer: dict[str, str], path: Path) -> tuple[str, pa.Table]:
    """Some columns with wrong values of their own type, in one row or in all."""
    told: list[str] = []
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        name = rng.choice(rows.column_names)
        column = rows[name].combine_chunks()
        value = wrong_value(rng, column.type)
        everywhere = rng.random() < 0.5
        place = rng.randrange(len(column)) if len(column) else 0
        values = [value if everywhere or i == place else old for i, old in enumerate(column.to_pylist())]
        try:
            changed = pa.array(values, column.type)
        except (pa.ArrowException, OverflowError, ValueError, TypeError, UnicodeError):
            changed = pa.nulls(len(column), column.type)
        rows = rows.set_column(rows.column_names.index(name), rows.schema.field(name).with_nullable(True), changed)
        told.append(f"{name} {'all' if everywhere else place} = {str(value)[:30]!r}")
    return ", ".join(told), rows


def wrong_value(rng: random.Random, kind: pa.DataType) -> object:
    """A value that a column of a type can have and should not."""
    if rng.random() < 0.2:
        return None
    if pa.types.is_floating(kind):
        return rng.choice(FLOATS)
    if pa.types.is_integer(kind):
        limit = 2 ** (kind.bit_width - 1)
        return rng.choice([number for number in WHOLE if -limit <= number < limit])
    if pa.types.is_boolean(kind):
        return rng.choice((True, False))
    if pa.types.is_struct(kind):
        data = rng.choice((None, b"", b"\x89PNG\r\n\x1a\n", rng.randbytes(100)))
        return {"bytes": data, "path": rng.choice((None, "../../outside/x"))}
    if pa.types.is_string(kind):
        return rng.choice([text[:TEXT_LIMIT] for text in TEXTS])
    return [rng.choice(FLOATS)] * 36


def _columns(rng: random.Random, rows: pa.Table, footer: dict[str, str], path: Path) -> tuple[str, pa.Table]:
    """Columns that are missing, of another type, twice or too many."""
    index = rng.randrange(rows.num_columns)
    name, column = rows.column_names[index], rows.column(index)
    ways: dict[str, Callable[[], pa.Table]] = {
        "missing": lambda: rows.remove_column(index),
        "null type": lambda: rows.set_column(index, name, pa.nulls(rows.num_rows)),
        "text": lambda: rows.set_column(index, name, pa.array([str(value)[:50] for value in column.to_pylist()])),
        "nested": lambda: rows.set_column(index, name, pa.array([[[1], [2, 3]]] * rows.num_rows)),
        "map": lambda: rows.set_column(
            index, name, pa.array([[("a", 1)]] * rows.num_rows, pa.map_(pa.string(), pa.int8()))
        ),
        "deep": lambda: rows.set_column(index, name, _deep(rows.num_rows, rng.choice((5, 40)))),
        "date": lambda: rows.set_column(index, name, pa.array([10**15] * rows.num_rows, pa.timestamp("us"))),
        "decimal": lambda: rows.set_column(index, name, pa.nulls(rows.num_rows, pa.decimal128(38, 2))),
        "float32": lambda: rows.set_column(index, name, pa.array([0.5] * rows.num_rows, pa.float32())),
        "too many": lambda: rows.append_column(rng.choice(TEXTS[10:])[:100] or "x", column),
        "renamed": lambda: rows.rename_columns([f"{n}{'x' * (i == index)}" for i, n in enumerate(rows.column_names)]),
        "other order": lambda: rows.select(rng.sample(rows.column_names, rows.num_columns)),
        "of another table": lambda: rows.append_column("visible2", pa.array([True] * rows.num_rows)),
        "short lists": lambda: rows.set_column(index, name, pa.array([[0.5] * rng.randrange(3)] * rows.num_rows)),
        "no columns": lambda: rows.select([]),
    }
    way = rng.choice(sorted(ways))
    return f"{name} {way}", ways[way]()


def _deep(count: int, depth: int) -> pa.Array:
    kind: pa.DataType = pa.int8()
    for _ in range(depth):
        kind = pa.list_(kind)
    return pa.nulls(count, kind)


def _rows(rng: random.Random, rows: pa.Table, footer: dict[str, str], path: Path) -> tuple[str, pa.Table]:
    """Rows that are missing, twice, in another order or of another shard."""
    order = list(range(rows.num_rows))
    ways: dict[str, Callable[[], pa.Table]] = {
        "none": lambda: rows.slice(0, 0),
        "fewer": lambda: rows.slice(0, rng.randrange(1, 1 + rows.num_rows)),
        "twice": lambda: pa.concat_tables([rows, rows]),
        "100 times": lambda: pa.concat_tables([rows] * 100),
        "one twice": lambda: rows.take([*order, order[-1]]),
        "shuffled": lambda: rows.take(rng.sample(order, len(order))),
        "first only": lambda: rows.take([0] * len(order)),
        "of another shard": lambda: read_rows(max(path.parent.glob("*.parquet"))).replace_schema_metadata(None),
    }
    way = rng.choice(sorted(ways))
    return f"rows {way}", ways[way]()


def _footer(rng: random.Random, rows: pa.Table, footer: dict[str, str], path: Path) -> tuple[str, pa.Table]:
    key = rng.choice((RECIPE_KEY, VERSION_KEY, PLACE_KEY, b"meanings", b"more")).decode()
    value = rng.choice(("", "2", "3", "4", "-1", "x" * 1_000_000, "frames/frames-00000-of-00002.parquet", "\ud7ff"))
    footer[key] = value
    if rng.random() < 0.3:
        del footer[key]
    return f"footer {key} = {value[:20]!r}", rows


def _file(rng: random.Random, rows: pa.Table, footer: dict[str, str], path: Path) -> tuple[str, pa.Table | None]:
    """Files that are no tables, or unpack to far more than they are."""
    way = rng.choice(("damaged", "folder", "device", "bomb of text", "bomb of rows", "many groups"))
    if way == "damaged":
        what, data = damaged(rng, path.read_bytes())
        path.write_bytes(data)
        return f"file {what}", None
    if way in ("folder", "device"):
        path.unlink()
        path.mkdir() if way == "folder" else path.symlink_to("/dev/zero")
        return way, None
    if way == "many groups":
        with pq.ParquetWriter(path, rows.schema) as writer:
            for _ in range(2000):
                writer.write_table(rows.slice(0, 1))
        return way, None
    write_bomb(path, TABLES[path.parent.name], footer, way == "bomb of text")
    return way, None


def write_bomb(path: Path, schema: pa.Schema, footer: dict[str, str], of_text: bool) -> None:
    """A small file that unpacks to some GiB: one long text, or one number, again and again."""
    count = 4000 if of_text else 10_000_000
    arrays = []
    for field in schema:
        if pa.types.is_string(field.type) and of_text:
            arrays.append(
                pa.DictionaryArray.from_arrays(pa.array([0] * count, pa.int32()), pa.array(["x" * 1_000_000]))
            )
        elif pa.types.is_integer(field.type) or of_text:
            arrays.append(pa.nulls(count, field.type))
        else:
            continue
    named = [field.name for field in schema if of_text or pa.types.is_integer(field.type)]
    rows = pa.table(arrays, names=named)
    with pq.ParquetWriter(path, rows.schema, compression="zstd", store_schema=False) as writer:
        writer.write_table(rows)
        writer.add_key_value_metadata({key: value for key, value in footer.items() if key != CHECKS_KEY.decode()})
