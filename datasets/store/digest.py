"""Identity of content: a hash of decoded values, without times, file formats or machine.

Parquet and PNG bytes differ between versions of their writers; what they decode to does not. Values that a reader
cannot tell apart count as one: every NaN and a null, zero of either sign.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pyarrow as pa

from datasets.store.images import decode_png
from datasets.store.nulls import is_list_of_floats, with_nans

NO_TEXT = b"\xff"  # a byte that no UTF-8 text has


def table_digest(table: pa.Table) -> str:
    """SHA-256 of a table's column names, types and decoded values; images count by their pixels.

    Raises:
        ValueError: an image cannot be decoded.
        TypeError: a column of a type that has no form here.
    """
    total = hashlib.sha256()
    for name in table.column_names:
        column = table.column(name).combine_chunks()
        total.update(f"{name}:{column.type}:{len(column)};".encode())
        for part in _values(column):
            total.update(part)
    return total.hexdigest()


def combined_digest(start: str, parts: Iterable[tuple[str, str]]) -> str:
    """SHA-256 of a text and of names with their digests, in order."""
    total = hashlib.sha256(start.encode())
    for name, digest in parts:
        total.update(f"{name}:{digest}".encode())
    return total.hexdigest()


def _values(column: Any) -> Iterator[bytes]:
    kind = column.type
    if pa.types.is_struct(kind):
        yield from (_image(row.as_py()) for row in column)
    elif pa.types.is_floating(kind) or is_list_of_floats(kind):
        values = with_nans(column).astype("<f8")
        yield np.where(np.isnan(values), np.nan, values + 0.0).tobytes()  # one NaN, one zero
    elif pa.types.is_integer(kind) or pa.types.is_boolean(kind):
        if column.null_count:
            yield column.is_valid().to_numpy(zero_copy_only=False).tobytes()
            column = column.fill_null(False if pa.types.is_boolean(kind) else 0)
        yield np.asarray(column.to_numpy(zero_copy_only=False), dtype="<i8").tobytes()
    elif pa.types.is_string(kind):
        yield b"\0".join(NO_TEXT if text is None else text.encode() for text in column.to_pylist())
    else:
        raise TypeError(f"a column of type {kind} has no canonical form; give it one here")


def _image(row: dict[str, Any]) -> bytes:
    pixels = decode_png(row["bytes"])
    return f"{pixels.shape}".encode() + pixels.tobytes()
