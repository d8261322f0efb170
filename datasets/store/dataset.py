"""A dataset on disk: atomic Parquet shards, bound to one recipe, resumable, verifiable.

A shard is written to a temporary name, flushed, checked and renamed; it is done if its footer can be read and carries
the recipe's hash and a version of the schema that can be read. Resuming is doing what is not there.

Read means checked: what is read of a shard is compared with the digests in its footer, with its place, and with the
frames that the plan has for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa

from datasets.errors import UserError
from datasets.recipe.model import Recipe, load_recipe
from datasets.schema import FRAME_ID, READABLE, SCHEMA_VERSION, TABLES
from datasets.store.atomic import replace_atomically, write_text
from datasets.store.card import card
from datasets.store.digest import table_digest
from datasets.store.kept_masters import kept_of
from datasets.store.keys import fault_of_keys, numbers_of, order_of, rows_of
from datasets.store.known_shards import entries_of
from datasets.store.manifest import MANIFEST_FILE, manifest_text
from datasets.store.nulls import with_nulls
from datasets.store.planned_rows import fault_of_truth
from datasets.store.provenance import Provenance
from datasets.store.refusals import RECIPE_FILE as RECIPE_FILE
from datasets.store.refusals import SHARD_NAME, damaged, foreign, missing, refused, stage_of, unreadable, unsupported
from datasets.store.shard_file import (
    DIGEST_KEY,
    PLACE_KEY,
    PROVISIONAL_KEY,
    RECIPE_KEY,
    UNREADABLE,
    VERSION_KEY,
    DamagedShardError,
    UnknownVersionError,
    place_of,
    read_footer,
    read_rows,
    version_of,
    write_rows,
)  # fmt: skip
from datasets.store.values import fault_of_values
from datasets.store.versions import as_begun, upgraded, with_later_columns

CARD_FILE = "README.md"


@dataclass(frozen=True)
class Dataset:
    """A dataset's folder and the recipe that it holds."""

    root: Path
    recipe: Recipe
    provenance: Provenance | None = None  # of what is written through this object; None: the manifest does not tell it
    check: bool = True  # whether what is read is checked; only who has checked it before may leave that out

    def shard_path(self, table: str, index: int, count: int, variant: str = "") -> Path:
        """Path of a shard; `variant` tells kinds of estimates apart."""
        return self.root / table / f"{variant or table}-{index:05d}-of-{count:05d}.parquet"

    def index_of(self, path: Path) -> int:
        """The number of a shard."""
        return numbers_of(path)[0]

    def sibling(self, path: Path, table: str, variant: str = "") -> Path:
        """The shard of another table over the same frames."""
        count = numbers_of(path)[1]
        return self.shard_path(table, self.index_of(path), count, variant)

    def is_done(self, path: Path) -> bool:
        """Whether a shard of this recipe is there for good; its rows are checked by who reads them.

        Raises:
            UserError: it may not be read, or its version cannot be.
        """
        footer = self._footer(path)
        return footer.get(RECIPE_KEY) == self.recipe.digest().encode() and PROVISIONAL_KEY not in footer

    def is_provisional(self, path: Path) -> bool:
        """Whether a shard is there that the next run makes again. Errors as `is_done`."""
        return PROVISIONAL_KEY in self._footer(path)

    def _footer(self, path: Path) -> dict[bytes, bytes]:
        """Keys and values of a shard's footer; none of a file that is not there or cannot be read as one."""
        if not path.is_file():
            return {}
        try:
            footer = read_footer(path).metadata or {}
        except PermissionError:
            raise unreadable(path) from None
        except UNREADABLE:
            return {}
        if VERSION_KEY in footer and version_of(footer) not in READABLE:
            raise unsupported(path, version_of(footer), READABLE)
        return footer

    def write_shard(self, path: Path, rows: pa.Table, *, is_provisional: bool = False) -> None:
        """Write one shard atomically. is_provisional: whether the next run is to make it again.

        Raises:
            UserError: the disk or its permissions refuse.
        """
        table = with_nulls(rows.cast(TABLES[path.parent.name]))
        footer = {
            RECIPE_KEY.decode(): self.recipe.digest(),
            VERSION_KEY.decode(): SCHEMA_VERSION,
            DIGEST_KEY.decode(): table_digest(table),
            PLACE_KEY.decode(): place_of(path),
        }
        if is_provisional:
            footer[PROVISIONAL_KEY.decode()] = "yes"
        try:
            with replace_atomically(path) as temporary:
                write_rows(temporary, path.parent.name, table, footer)
                read_footer(temporary)
        except OSError as error:
            raise refused(path, error) from error

    def remove_shard(self, path: Path) -> None:
        """Remove a shard if it is there.

        Raises:
            UserError: the disk or its permissions refuse.
        """
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise refused(path, error) from error

    def read_shard(self, path: Path, columns: list[str] | None = None) -> pa.Table:
        """The rows of one shard, or some columns of them; those of an earlier version of the schema in today's form.

        Raises:
            UserError: missing, damaged, of another recipe or place, of a version that cannot be read, or not of the
                frames that the plan has for it.
        """
        name = path.parent.name
        wanted = columns or TABLES[name].names
        rows = self.stored_rows(path, list(dict.fromkeys([FRAME_ID, *wanted])))
        if self.check:
            fault = (
                fault_of_values(name, rows)
                or fault_of_keys(self.recipe, path, rows)
                or fault_of_truth(self.recipe, name, self.index_of(path), rows)
            )
            if fault:
                raise damaged(path, fault)
        if version_of(rows.schema.metadata) != SCHEMA_VERSION:
            rows = upgraded(rows, name)
        return with_later_columns(rows, name).select(wanted)

    def stored_rows(self, path: Path, columns: list[str] | None = None) -> pa.Table:
        """The rows of one shard as they lie in its file, or those of some columns that are there.

        Raises:
            UserError: as `read_shard`, but for the plan's frames.
        """
        try:
            rows = read_rows(path, columns, check=self.check, most_rows=rows_of(self.recipe, path))
        except FileNotFoundError:
            raise missing(path) from None
        except PermissionError:
            raise unreadable(path) from None
        except UnknownVersionError as error:
            raise unsupported(path, str(error), READABLE) from None
        except DamagedShardError as error:
            raise damaged(path, str(error)) from None
        except UNREADABLE:
            raise damaged(path) from None
        footer = rows.schema.metadata or {}
        if footer.get(RECIPE_KEY) != self.recipe.digest().encode():
            raise foreign(path)
        if PLACE_KEY in footer and footer[PLACE_KEY] != place_of(path).encode():
            raise foreign(path, f"at {footer[PLACE_KEY].decode('utf-8', 'replace')}")
        return rows

    def shards(self, table: str) -> list[Path]:
        """Finished shards of a table, in order."""
        found = (path for path in (self.root / table).glob("*.parquet") if SHARD_NAME.fullmatch(path.name))
        return sorted(found, key=order_of)

    def read(self, table: str, columns: list[str] | None = None) -> pa.Table:
        """All rows of a table in order. Errors as `each_shard`."""
        return pa.concat_tables(self.each_shard(table, columns)).replace_schema_metadata(None)

    def each_shard(self, table: str, columns: list[str] | None = None) -> Iterator[pa.Table]:
        """The rows of a table shard by shard, in order, so that one shard is held at a time.

        Raises:
            UserError: there are none, one is missing beside others, or one is damaged.
        """
        for path in self.whole(table):
            yield self.read_shard(path, columns)

    def whole(self, table: str) -> list[Path]:
        """The shards of a table, in order, each kind with all that it must have.

        Raises:
            UserError: there are none, or one is missing beside others.
        """
        paths = self.shards(table)
        if not paths:
            raise UserError(f"{self.root} has no {table} yet; run the {stage_of(self.root / table / 'x')} stage first")
        there = set(paths)
        told = {match.groups() for match in (SHARD_NAME.fullmatch(path.name) for path in paths) if match}
        for variant, count in sorted(told):
            for path in (self.shard_path(table, index, int(count), variant) for index in range(int(count))):
                if path not in there:
                    raise missing(path)
        return paths

    def write_manifest(self) -> None:
        """Manifest and dataset card, both derived from the shards and rebuilt at every stage's end.

        Raises:
            UserError: a shard is damaged, or the disk or its permissions refuse.
        """
        entries = entries_of(self.root, [path for table in TABLES for path in self.shards(table)])
        text = manifest_text(self.root, self.recipe, entries, self.provenance)
        write_text(self.root / MANIFEST_FILE, text)
        frames = sum(entry["rows"] for entry in entries if entry["path"].startswith("frames/"))
        tables = [table for table in TABLES if self.shards(table)]
        write_text(self.root / CARD_FILE, card(self.recipe, frames, tables, kept_of(self.root)))


def open_dataset(root: Path, provenance: Provenance | None = None, *, check: bool = True) -> Dataset:
    """The dataset in a folder. provenance: of what will be written. check: whether what is read is checked.

    Raises:
        UserError: no dataset there.
    """
    path = root / RECIPE_FILE
    if not path.is_file():
        raise UserError(f"{root} holds no dataset ({RECIPE_FILE} is missing); run `generate RECIPE --out {root}` first")
    return Dataset(root, as_begun(load_recipe(path)[0], root), provenance, check)
