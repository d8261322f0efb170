"""A dataset as version 2 of the tables had it."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from datasets.schema import TABLES
from datasets.store.digest import table_digest
from datasets.store.nulls import is_list_of_floats, with_nans
from datasets.store.shard_file import read_rows

NEW = {"failure_reason", "distance_mm", "field_deg", "tilt_deg"}  # columns of `scores` that version 2 did not have


def make_old(root):
    """Rewrite a dataset's shards: NaN for null, without the new columns, another version in the footer."""
    for table in TABLES:
        for path in (root / table).glob("*.parquet"):
            make_shard_old(path)


def make_shard_old(path):
    rows = read_rows(path)
    footer = rows.schema.metadata
    if path.parent.name == "scores":
        rows = rows.select([name for name in rows.column_names if name not in NEW])
    for i, field in enumerate(rows.schema):
        if pa.types.is_floating(field.type):
            rows = rows.set_column(i, field, pa.array(with_nans(rows.column(i))))
        elif is_list_of_floats(field.type):
            values = pa.array(np.ravel(with_nans(rows.column(i))))
            rows = rows.set_column(i, field, pa.FixedSizeListArray.from_arrays(values, type=field.type))
    keys = {b"recipe": footer[b"recipe"], b"schema_version": b"2", b"content": table_digest(rows).encode()}
    pq.write_table(rows.replace_schema_metadata(keys), path, compression="zstd")
