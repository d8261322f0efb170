"""Versions of the tables: shards of an earlier one are read as if they had been written today."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa

from datasets.plan import shard_count
from datasets.recipe.model import Recipe
from datasets.schema import LATER_COLUMNS, SCORES_ADDED, TABLES
from datasets.store.nulls import with_nulls
from datasets.store.refusals import SHARD_NAME
from datasets.store.shard_file import RECIPE_KEY, UNREADABLE, has_digests, read_footer

OLD_SHARD_FRAMES = 10  # of a recipe without `shard_frames`, when the version was 2
OLD_MOST_SHARD_FRAMES = 200  # of such a recipe, before large datasets of small pictures had more


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


def with_later_columns(rows: pa.Table, table: str) -> pa.Table:
    """Rows with a column of nulls for each that the table got after they were written; rows that have all stay."""
    for field in TABLES[table]:
        if field.name in LATER_COLUMNS and field.name not in rows.column_names:
            rows = rows.append_column(field, pa.nulls(rows.num_rows, field.type))
    return rows


def as_begun(recipe: Recipe, root: Path) -> Recipe:
    """A recipe as a folder's shards were made, if there are any: one without `shard_frames` meant 10 in version 2.

    The footers tell: they carry the hash of the recipe with the number that was meant. Later the number was not in the
    hash, and at most 200: then the files' names tell.
    """
    if recipe.shard_frames is not None:
        return recipe
    old = recipe.model_copy(update={"shard_frames": OLD_SHARD_FRAMES})
    if old.digest() in _carried(root):
        return old
    cut_before = recipe.with_most_shard_frames(OLD_MOST_SHARD_FRAMES)
    counts = {shard_count(recipe), shard_count(cut_before)}
    return cut_before if len(counts) == 2 and _count_in_names(root) == shard_count(cut_before) else recipe


def _count_in_names(root: Path) -> int | None:
    """How many shards a folder's files say that there are; None of a folder without any."""
    names = (path.name for path in sorted((root / "frames").glob("[!.]*.parquet")))
    return next((int(found[2]) for found in map(SHARD_NAME.fullmatch, names) if found), None)


def without_digests(root: Path) -> bool:
    """Whether the first shard of a table is of an earlier version of this program, which wrote no digests."""
    for table in TABLES:
        for path in sorted((root / table).glob("[!.]*.parquet"))[:1]:
            try:
                if not has_digests(read_footer(path).metadata or {}):
                    return True
            except UNREADABLE:
                continue  # whoever reads the rows says what is wrong with it
    return False


def _carried(root: Path) -> Iterator[str]:
    """Hashes of recipes that a folder's shards carry, one of each table."""
    for table in TABLES:
        for path in sorted((root / table).glob("[!.]*.parquet")):
            try:
                yield (read_footer(path).metadata or {}).get(RECIPE_KEY, b"").decode("utf-8", "replace")
                break
            except UNREADABLE:
                continue  # whoever reads the rows says what is wrong with it


def _reasons(rows: pa.Table) -> pa.Array:
    return pa.array([None if status == "ok" else status for status in rows["status"].to_pylist()], pa.string())
