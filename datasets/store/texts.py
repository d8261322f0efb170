"""How long the texts of a column are."""

from __future__ import annotations

from typing import Literal

import pyarrow as pa
import pyarrow.compute as pc


def longest(texts: pa.Array | pa.ChunkedArray, length: Literal["utf8_length", "binary_length"]) -> int:
    """The length of the longest of a column, in letters or in bytes; 0 without any."""
    lengths = pc.call_function(length, [texts])
    return pc.call_function("max", [lengths]).as_py() or 0


def total_bytes(texts: pa.ChunkedArray) -> int:
    """How many bytes the texts of a dictionary-encoded column have, each as often as it stands there."""
    count = 0
    for chunk in texts.chunks:
        lengths = pc.call_function("binary_length", [chunk.dictionary])
        count += pc.call_function("sum", [lengths.take(chunk.indices)]).as_py() or 0
    return count
