"""Identity of content: a hash of decoded values, without times, file formats or machine.

Parquet and PNG bytes differ between versions of their writers; what they decode to does not.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
import pyarrow as pa

from datasets.store.images import decode_png


def table_digest(table: pa.Table) -> str:
    """SHA-256 of a table's column names, types and decoded values; images count by their pixels."""
    total = hashlib.sha256()
    for name in table.column_names:
        column = table.column(name).combine_chunks()
        total.update(f"{name}:{column.type}:{len(column)};".encode())
        total.update(_values(column))
    return total.hexdigest()


def _values(column: Any) -> bytes:
    if pa.types.is_struct(column.type):
        return b"".join(_image(row) for row in column.to_pylist())
    if pa.types.is_fixed_size_list(column.type):
        return _values(column.flatten())
    if pa.types.is_floating(column.type):
        values = np.asarray(column.to_numpy(zero_copy_only=False), dtype="<f8")
        return np.where(np.isnan(values), np.nan, values + 0.0).tobytes()  # one NaN, one zero
    if pa.types.is_integer(column.type) or pa.types.is_boolean(column.type):
        return np.asarray(column.to_numpy(zero_copy_only=False), dtype="<i8").tobytes()
    return b"\0".join(str(value).encode() for value in column.to_pylist())


def _image(row: dict[str, Any]) -> bytes:
    pixels = decode_png(row["bytes"])
    return f"{pixels.shape}".encode() + pixels.tobytes()
