"""One shard as a Parquet file: rows, and a footer that says what they are.

A footer stands in every shard, so it is kept small: Arrow's own copy of the schema, which repeats every key in base64,
is left out; Parquet's types say the same but for the length of a list, which the schema here knows. Meanings are one
JSON text for the file. Statistics are kept for the columns by which readers choose shards.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from datasets.schema import KEYS, TABLES, meanings
from datasets.store.nulls import is_list_of_floats

RECIPE_KEY, VERSION_KEY, DIGEST_KEY = b"recipe", b"schema_version", b"content"
MEANINGS_KEY = "meanings"  # column name to meaning, JSON
HUGGINGFACE_KEY = "huggingface"  # which columns are images, as Hugging Face's `datasets` reads it


def write_rows(path: Path, table: str, rows: pa.Table, footer: dict[str, str]) -> None:
    """Write rows of a table with keys and values for the footer.

    Raises:
        OSError: the system refuses.
    """
    schema = TABLES[table]
    options: dict[str, Any] = {
        "compression": "zstd",
        "use_dictionary": [field.name for field in schema if pa.types.is_string(field.type)],
        "write_statistics": [name for name in schema.names if name in KEYS],
        "store_schema": False,
    }
    with pq.ParquetWriter(path, schema.remove_metadata(), **options) as writer:
        writer.write_table(rows)
        writer.add_key_value_metadata(footer | _described(schema))


def read_rows(path: Path, columns: list[str] | None = None) -> pa.Table:
    """All columns, or those of some that are there; lists have their lengths again.

    Raises:
        OSError, pa.ArrowInvalid: it cannot be read.
    """
    if columns is not None:
        there = pq.read_schema(path).names
        columns = [name for name in columns if name in there]
    rows, schema = pq.read_table(path, columns=columns), TABLES[path.parent.name]
    for i, field in enumerate(rows.schema):
        if pa.types.is_list(field.type) and field.name in schema.names:
            wanted = schema.field(field.name)
            if is_list_of_floats(wanted.type) and field.type.value_type == wanted.type.value_type:
                rows = rows.set_column(i, wanted.remove_metadata(), rows.column(i).cast(wanted.type))
    return rows


def _described(schema: pa.Schema) -> dict[str, str]:
    """What a reader without this program needs."""
    described = {MEANINGS_KEY: json.dumps(meanings(schema), separators=(",", ":"))}
    images = {field.name: {"_type": "Image"} for field in schema if pa.types.is_struct(field.type)}
    return described | ({HUGGINGFACE_KEY: json.dumps({"info": {"features": images}})} if images else {})
