"""How the columns of a Parquet file are stored, read from its footer without trusting it.

pyarrow ends the process where a footer contradicts itself: `RowGroupMetaData.column` lets a C++ exception pass. So what
has to be known before a file is unpacked is read here, from the bytes.

Source:
    Apache Parquet format, parquet.thrift; Apache Thrift, compact protocol.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

MAGIC, TAIL = b"PAR1", 8
DEEPEST = 16  # structures within each other
# Kinds of the compact protocol.
STOP, YES, NO, BYTE, DOUBLE, BINARY, LISTS, STRUCT = 0, 1, 2, 3, 7, 8, (9, 10), 12
# Numbers of fields in parquet.thrift.
ROW_GROUPS, COLUMNS, META_DATA = 4, 1, 3
ENCODINGS, PATH, VALUES, UNCOMPRESSED, DICTIONARY = 2, 3, 5, 6, 11


class FooterError(ValueError):
    """The bytes are no footer of a Parquet file."""


@dataclass(frozen=True, slots=True)
class StoredColumn:
    """A column of a row group, as the footer has it."""

    name: str  # with dots
    encodings: frozenset[int]  # numbers of parquet.thrift's Encoding
    values: int
    uncompressed_bytes: int
    has_dictionary: bool


def stored_columns(path: Path) -> list[StoredColumn]:
    """The columns of all row groups of a file.

    Raises:
        FooterError: it is none of a Parquet file.
        OSError: it cannot be read.
    """
    with path.open("rb") as file:
        size = file.seek(0, 2)
        file.seek(max(size - TAIL, 0))
        tail = file.read(TAIL)
        length = int.from_bytes(tail[:4], "little")
        if tail[4:] != MAGIC or length > size - TAIL:
            raise FooterError("its end is not that of a Parquet file")
        file.seek(size - TAIL - length)
        data = file.read(length)
    return list(_columns(data))


@functools.lru_cache(maxsize=128)  # stages that follow each other read the same shards
def _columns(data: bytes) -> tuple[StoredColumn, ...]:
    try:
        groups = _Compact(data).struct(0)[ROW_GROUPS]
        return tuple(_column(chunk[META_DATA]) for group in groups for chunk in group[COLUMNS])
    except (IndexError, KeyError, TypeError, AttributeError, UnicodeDecodeError) as error:
        raise FooterError("its footer is damaged") from error


def _column(told: dict[int, Any]) -> StoredColumn:
    name = ".".join(part.decode() for part in told[PATH])
    encodings = frozenset(int(number) for number in told[ENCODINGS])
    return StoredColumn(name, encodings, int(told[VALUES]), int(told[UNCOMPRESSED]), DICTIONARY in told)


class _Compact:
    """A reader of the compact protocol; beyond the end it raises IndexError."""

    def __init__(self, data: bytes) -> None:
        self._data, self._at = data, 0

    def struct(self, depth: int) -> dict[int, Any]:
        """Fields by number."""
        found: dict[int, Any] = {}
        number = 0
        while (head := self._byte()) & 15 != STOP:
            number = number + (head >> 4) if head >> 4 else self._signed()
            kind = head & 15
            found[number] = kind == YES if kind in (YES, NO) else self._value(kind, depth)
        return found

    def _value(self, kind: int, depth: int) -> Any:
        if depth > DEEPEST:
            raise FooterError("its footer is nested too deeply")
        if kind in (YES, NO, BYTE):
            return self._byte()
        if kind < DOUBLE:
            return self._signed()
        if kind == DOUBLE:
            return self._bytes(8)
        if kind == BINARY:
            return self._bytes(self._unsigned())
        if kind in LISTS:
            head = self._byte()
            count = head >> 4 if head >> 4 < 15 else self._unsigned()
            return [self._value(head & 15, depth + 1) for _ in range(self._possible(count))]
        if kind == STRUCT:
            return self.struct(depth + 1)
        raise FooterError("its footer has a value of an unknown kind")  # Parquet has no maps

    def _possible(self, count: int) -> int:
        """A count of things of a byte or more each."""
        if count > len(self._data) - self._at:
            raise FooterError("its footer ends too early")
        return count

    def _byte(self) -> int:
        self._at += 1
        return self._data[self._at - 1]

    def _bytes(self, count: int) -> bytes:
        self._at += self._possible(count)
        return self._data[self._at - count : self._at]

    def _unsigned(self) -> int:
        value = shift = 0
        while True:
            byte = self._byte()
            value |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return value
            if shift > 63:
                raise FooterError("its footer has a number that is too large")

    def _signed(self) -> int:
        value = self._unsigned()
        return (value >> 1) ^ -(value & 1)
