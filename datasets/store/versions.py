"""Versions of the tables: shards of an earlier one are read as if they had been written today."""

from __future__ import annotations

import pyarrow as pa
import pyarrow.compute as pc

from datasets.schema import SCHEMA_VERSION, TABLES
from datasets.store.nulls import with_nulls

NAN_VERSION = "2"  # had NaN for every null, and `scores` without what `SCORES_ADDED` names
READABLE = (NAN_VERSION, SCHEMA_VERSION)
SCORES_ADDED = ("failure_reason", "distance_mm", "field_deg", "tilt_deg")
OLD_SHARD_FRAMES = 10  # of a recipe without `shard_frames`, when the version was 2


def upgraded(rows: pa.Table, table: str) -> pa.Table:
    """Rows of version 2, all columns or some, in today's form: nulls for NaN, added columns at their places.

    A failure's reason is then its status, and the places of the target are null.
    """
    schema, rows = TABLES[table], with_nulls(rows)
    for name in SCORES_ADDED if table == "scores" else ():
        field = schema.field(name)
        known = name == "failure_reason" and "status" in rows.column_names
        rows = rows.append_column(field, _reasons(rows) if known else pa.nulls(rows.num_rows, field.type))
    return rows


def _reasons(rows: pa.Table) -> pa.ChunkedArray:
    status = rows["status"]
    return pc.if_else(pc.equal(status, "ok"), pa.scalar(None, status.type), status)  # type: ignore[attr-defined]
