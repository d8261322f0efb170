"""One shard as a Parquet file: rows, and a footer that says what they are.

A footer stands in every shard, so it is kept small: Arrow's own copy of the schema, which repeats every key in base64,
is left out; Parquet's types say the same but for the length of a list, which the schema here knows. Meanings are one
JSON text for the file. Statistics are kept for the columns by which readers choose shards.

The footer has a digest of each column, so that who reads some columns checks these and no others, and one of its own
keys and values. Parquet's checksums of pages are written, too: a damaged page is refused before it is unpacked.
"""

from __future__ import annotations

import json
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from datasets.schema import KEYS, LATER_COLUMNS, NAN_VERSION, READABLE, SCORES_ADDED, TABLES, meanings
from datasets.store.digest import column_digest, text_digest
from datasets.store.nulls import is_list_of_floats
from datasets.store.parquet_footer import stored_columns
from datasets.store.texts import longest
from datasets.url_path import UrlPath

RECIPE_KEY, VERSION_KEY, DIGEST_KEY = b"recipe", b"schema_version", b"content"
PLACE_KEY = b"place"  # table and name of the file, so that a shard under another's name is known
PROVISIONAL_KEY = b"provisional"  # in the footer of a shard that the next run makes again
CHECKS_KEY = b"checks"  # a digest of each column in their order, then one of the other keys and values
MEANINGS_KEY = "meanings"  # column name to meaning, JSON
HUGGINGFACE_KEY = "huggingface"  # which columns are images, as Hugging Face's `datasets` reads it
SMALL_ROWS, SMALL_BYTES = 100_000, 64_000_000  # that any file may have
MOST_EXPANSION = 20  # bytes of columns that one byte of a file may hold; pictures cannot be packed
MOST_TEXT_BYTES = 4000
MOST_REPEATED = 10**9  # bytes of pictures that are stored once for several rows
# Others, as DELTA_BYTE_ARRAY, hold far more than their size.
ENCODINGS = frozenset({0, 2, 3, 4, 8})  # plain, plain dictionary, RLE, bit packed, RLE dictionary: see `parquet_footer`
Footer = dict[bytes, bytes]
# What Arrow raises of files that are damaged or no Parquet, from where it notices.
UNREADABLE = (OSError, ValueError, LookupError, ArithmeticError, MemoryError, TypeError, pa.ArrowException)


class UnknownVersionError(ValueError):
    """A shard of a version of the schema that is not known here; the message is the version."""


class DamagedShardError(ValueError):
    """A shard that does not hold what was written; the message says in a few words what is wrong."""


def write_rows(path: Path, table: str, rows: pa.Table, footer: dict[str, str]) -> None:
    """Write rows of a table with keys and values for the footer, and digests of all.

    Raises:
        OSError: the system refuses.
    """
    schema = TABLES[table]
    options: dict[str, Any] = {
        "compression": "zstd",
        "use_dictionary": [field.name for field in schema if pa.types.is_string(field.type)],
        "write_statistics": [name for name in schema.names if name in KEYS],
        "store_schema": False,
        "write_page_checksum": True,
    }
    told = footer | _described(schema)
    digests = [*(column_digest(name, rows.column(name)) for name in rows.column_names), _footer_digest(told)]
    with pq.ParquetWriter(path, schema.remove_metadata(), **options) as writer:
        writer.write_table(rows)
        writer.add_key_value_metadata(told | {CHECKS_KEY.decode(): " ".join(digests)})


def read_footer(path: Path) -> pq.FileMetaData:
    """What the end of a Parquet file says.

    Raises:
        UNREADABLE: it cannot be read.
    """
    with _readable(path) as source:
        return pq.read_metadata(source)


def _readable(path: Path) -> AbstractContextManager[Any]:
    """What pyarrow reads a file from: its path, or its ranges in an object store."""
    return path.open("rb") if isinstance(path, UrlPath) else nullcontext(path)


def read_rows(
    path: Path, columns: list[str] | None = None, *, check: bool = True, most_rows: int | None = None
) -> pa.Table:
    """All columns, or those of some that are there; lists have their lengths again. The footer is the table's metadata.

    check: whether what is read is compared with its digests, where the file has any. most_rows: that the shard may
    have, or SMALL_ROWS; nothing of a file with more is read, nor of one that unpacks to far more than its size.

    Raises:
        UnknownVersionError: its version is not known here.
        DamagedShardError: it is not what was written.
        UNREADABLE: it cannot be read.
    """
    schema = TABLES[path.parent.name]
    if not path.is_file():
        raise FileNotFoundError(path) if not path.exists() else DamagedShardError("it is no file")
    metadata = read_footer(path)
    _check_size(path, metadata, most_rows)
    texts = [
        name for name in metadata.schema.names if name in schema.names and pa.types.is_string(schema.field(name).type)
    ]
    options: dict[str, Any] = {"metadata": metadata, "page_checksum_verification": check, "read_dictionary": texts}
    with _readable(path) as source, pq.ParquetFile(source, **options) as file:
        names, footer = file.schema_arrow.names, file.metadata.metadata or {}
        if VERSION_KEY in footer and version_of(footer) not in READABLE:
            raise UnknownVersionError(version_of(footer))
        digests = _digests(names, footer) if check else {}
        _check_names(names, path.parent.name, version_of(footer))
        rows = file.read(None if columns is None else [name for name in columns if name in names])
    rows = _with_list_lengths(_with_texts(rows), schema)
    for field in rows.schema:
        if field.type != schema.field(field.name).type:
            raise DamagedShardError(f"its column {field.name} is of type {field.type}")
        if digests and column_digest(field.name, rows.column(field.name)) != digests[field.name]:
            raise DamagedShardError(f"the values of {field.name} are not those that were written")
    return rows.replace_schema_metadata(footer)


def _check_size(path: Path, metadata: Any, most_rows: int | None) -> None:
    """Refuse a file before anything of it is unpacked.

    A text that repeats is stored once, so that its size tells nothing; other columns are stored row by row.

    Raises:
        DamagedShardError: it is larger than a shard can be.
    """
    if most_rows is not None and metadata.num_rows > max(most_rows, SMALL_ROWS):
        raise DamagedShardError(f"it has {metadata.num_rows} rows, and {most_rows} are planned")
    unpacked = repeated = 0
    for column in stored_columns(path):
        unpacked += column.uncompressed_bytes
        if not column.encodings <= ENCODINGS:
            raise DamagedShardError(f"its {column.name} is stored as this program never does")
        if column.name == "image.bytes" and column.has_dictionary:  # as earlier versions did
            repeated = max(repeated, column.values * column.uncompressed_bytes)
    if repeated > MOST_REPEATED:
        raise DamagedShardError("its pictures may unpack to more than memory can hold")
    if unpacked > MOST_EXPANSION * path.stat().st_size + SMALL_BYTES:
        raise DamagedShardError(f"it unpacks to {unpacked >> 20} MiB, more than a file of its size can hold")


def _with_texts(rows: pa.Table) -> pa.Table:
    """Texts as such, once it is known that none is too long to be repeated."""
    for i, field in enumerate(rows.schema):
        if pa.types.is_dictionary(field.type):
            for chunk in rows.column(i).chunks:
                if longest(chunk.dictionary, "binary_length") > MOST_TEXT_BYTES:
                    raise DamagedShardError(f"its {field.name} has a text of more than {MOST_TEXT_BYTES} bytes")
            rows = rows.set_column(i, field.name, rows.column(i).cast(field.type.value_type))
    return rows


def version_of(footer: Footer) -> str:
    """The version of the schema that a footer states; empty if it states none."""
    return footer.get(VERSION_KEY, b"").decode("utf-8", "replace")


def place_of(path: Path) -> str:
    """What `PLACE_KEY` says in the file of a shard."""
    return f"{path.parent.name}/{path.name}"


def has_digests(footer: Footer) -> bool:
    """Whether a shard's values can be checked when they are read: older shards have none."""
    return CHECKS_KEY in footer


def _digests(names: list[str], footer: Footer) -> dict[str, str]:
    """Column to digest; nothing where the file has none.

    Raises:
        DamagedShardError: the footer is not what was written.
    """
    if not has_digests(footer):
        return {}
    *columns, own = footer[CHECKS_KEY].decode("utf-8", "replace").split(" ")
    told = {_text(key): _text(value) for key, value in footer.items() if key != CHECKS_KEY}
    if own != _footer_digest(told) or len(columns) != len(names):
        raise DamagedShardError("its footer is not the one that was written")
    return dict(zip(names, columns, strict=True))


def _check_names(names: list[str], table: str, version: str) -> None:
    """Refuse columns that are not those of a table: later ones may lack.

    Raises:
        DamagedShardError: with the first that is wrong.
    """
    added = SCORES_ADDED if table == "scores" and version == NAN_VERSION else ()
    wanted = [name for name in TABLES[table].names if name not in added]
    unknown = [name for i, name in enumerate(names) if name not in wanted or name in names[:i]]
    lacking = [name for name in wanted if name not in names and name not in LATER_COLUMNS]
    if unknown or lacking:
        what = f"has a column {unknown[0]!r} too many" if unknown else f"lacks the column {lacking[0]!r}"
        raise DamagedShardError(f"it {what}")


def _footer_digest(footer: dict[str, str]) -> str:
    return text_digest(json.dumps(sorted(footer.items())))


def _text(data: bytes) -> str:
    return data.decode("utf-8", "backslashreplace")


def _with_list_lengths(rows: pa.Table, schema: pa.Schema) -> pa.Table:
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
