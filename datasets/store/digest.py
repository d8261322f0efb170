"""Identity of content: a hash of decoded values, without times, file formats or machine.

Parquet and PNG bytes differ between versions of their writers; what they decode to does not. Values that a reader
cannot tell apart count as one: every NaN and a null, zero of either sign.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import numpy as np
import pyarrow as pa

from datasets.schema import LATER_COLUMNS
from datasets.store.images import decode_pixels
from datasets.store.nulls import is_list_of_floats, is_ragged_list_of_floats, with_nans

SHORT_DIGEST = (
    6  # bytes, eight letters of base 64: against damage, not against forgers: one of 2^48 damages goes unseen
)
NO_TEXT = b"\xff"  # a byte that no UTF-8 text has


def table_digest(table: pa.Table) -> str:
    """SHA-256 of a table's column names, types and decoded values; images count by their pixels.

    Columns that older datasets do not have take no part where they hold nothing.

    Raises:
        ValueError: an image cannot be decoded.
        TypeError: a column of a type that has no form here.
    """
    total = hashlib.sha256()
    for name in table.column_names:
        column = table.column(name).combine_chunks()
        if name in LATER_COLUMNS and column.null_count == len(column):
            continue
        total.update(f"{name}:{column.type}:{len(column)};".encode())
        for part in _values(column):
            total.update(part)
    return total.hexdigest()


def column_digest(name: str, column: Any) -> str:
    """48 bits of SHA-256 of a column's name, type and values; images count by their bytes, so that none is decoded.

    Raises:
        TypeError: a column of a type that has no form here.
    """
    column = column.combine_chunks()
    total = hashlib.sha256(f"{name}:{column.type}:{len(column)};".encode())
    for part in _stored_images(column) if pa.types.is_struct(column.type) else _values(column):
        total.update(part)
    return _short(total.digest())


def text_digest(text: str) -> str:
    """48 bits of SHA-256 of a text."""
    return _short(hashlib.sha256(text.encode()).digest())


def _short(digest: bytes) -> str:
    return base64.b64encode(digest[:SHORT_DIGEST]).decode()


def combined_digest(start: str, parts: Iterable[tuple[str, str]]) -> str:
    """SHA-256 of a text and of names with their digests, in order."""
    total = hashlib.sha256(start.encode())
    for name, digest in parts:
        total.update(f"{name}:{digest}".encode())
    return total.hexdigest()


def _values(column: Any) -> Iterator[bytes]:
    """A column's values as bytes that do not depend on its storage: alike where the values count as one."""
    form = next((form for is_of_type, form in FORMS if is_of_type(column.type)), None)
    if form is None:
        raise TypeError(f"a column of type {column.type} has no canonical form; give it one here")
    return form(column)


def _images(column: Any) -> Iterator[bytes]:
    for row in column:
        pixels = decode_pixels(row.as_py()["bytes"])
        yield f"{pixels.shape}".encode() + pixels.tobytes()


def _stored_images(column: Any) -> Iterator[bytes]:
    for row in column.to_pylist():
        data, path = row["bytes"], row["path"]
        yield f"{len(data)}:{path};".encode() + data


def _floats(column: Any) -> Iterator[bytes]:
    values = with_nans(column).astype("<f8")
    yield np.where(np.isnan(values), np.nan, values + 0.0).tobytes()  # one NaN, one zero


def _ragged_floats(column: Any) -> Iterator[bytes]:
    """The lists' lengths, -1 for a null, and then all their values."""
    lengths = column.value_lengths().fill_null(-1)
    yield np.asarray(lengths.to_numpy(zero_copy_only=False), dtype="<i8").tobytes()
    yield from _floats(column.drop_null().flatten())


def _whole_numbers(column: Any) -> Iterator[bytes]:
    """Integers or booleans; nulls count as 0, behind a mask that tells them from it."""
    if column.null_count:
        yield column.is_valid().to_numpy(zero_copy_only=False).tobytes()
        column = column.fill_null(False if pa.types.is_boolean(column.type) else 0)
    yield np.asarray(column.to_numpy(zero_copy_only=False), dtype="<i8").tobytes()


def _texts(column: Any) -> Iterator[bytes]:
    yield b"\0".join(NO_TEXT if text is None else text.encode() for text in column.to_pylist())


# The canonical form of each type of column; no type is in two lines.
FORMS: tuple[tuple[Callable[[pa.DataType], bool], Callable[[Any], Iterator[bytes]]], ...] = (
    (pa.types.is_struct, _images),
    (pa.types.is_floating, _floats),
    (is_list_of_floats, _floats),
    (is_ragged_list_of_floats, _ragged_floats),
    (pa.types.is_integer, _whole_numbers),
    (pa.types.is_boolean, _whole_numbers),
    (pa.types.is_string, _texts),
)
