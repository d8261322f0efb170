"""Tables of poses, CSV or Parquet, as columns."""

from __future__ import annotations

import csv
import itertools
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from datasets.errors import UserError
from datasets.rows import POSITION_COLUMNS, QUATERNION_COLUMNS
from datasets.store.texts import total_bytes

FRAME = "frame_id"
MATRIX = tuple(f"r{row}{column}" for row in "123" for column in "123")
VECTOR = tuple(f"rvec_{axis}" for axis in "xyz")  # OpenCV's rotation vector, rad
POSITIONS = (POSITION_COLUMNS, tuple(f"t{axis}" for axis in "xyz"), tuple(f"tvec_{axis}" for axis in "xyz"))
LISTS = {"rvec": VECTOR, "tvec": POSITIONS[2]}  # columns of three numbers each, to columns of one
NamesAndColumns = tuple[list[str], list[list[Any]]]
Reader = Callable[[Path], NamesAndColumns]
KNOWN = frozenset({FRAME, "status", *QUATERNION_COLUMNS, *MATRIX, *VECTOR, *(n for names in POSITIONS for n in names)})
MOST_ROWS, MOST_BYTES = 2_000_000, 1_000_000_000  # of a file of poses
MOST_TEXT_BYTES = 200_000_000  # of all texts of a column


def columns_of(path: Path, reader: Reader | None = None) -> dict[str, list[Any]]:
    """Name to values; of text they are text. reader: instead of the one that the suffix tells.

    Raises:
        UserError: a file that cannot be read.
    """
    read = reader or READERS.get(path.suffix.lower())
    if read is None:
        raise UserError(f"{path} is neither .csv nor .parquet; give --poses one of them, or tell its --pose-format")
    if path.exists() and not path.is_file():
        raise UserError(f"cannot read {path}: it is no regular file, and may never end; give --poses a file")
    if path.exists() and path.stat().st_size > MOST_BYTES:
        raise UserError(f"{path} has more than {MOST_BYTES // 10**6} MB; give --poses a file with a row for each image")
    try:
        header, values = read(path)
    except UnicodeDecodeError:
        raise UserError(f"cannot read {path}: it is not UTF-8 text; give --poses a .csv or .parquet file") from None
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror or 'it is damaged'}; give --poses another file") from None
    except (pa.ArrowException, csv.Error, MemoryError) as error:
        raise UserError(f"cannot read {path}: {_first_line(error)}; give --poses another file") from None
    twice = next((name for i, name in enumerate(header) if name in header[:i]), None)
    if twice is not None:
        raise UserError(f"{path} has the column {twice!r} twice; leave one out")
    return dict(zip(header, values, strict=True))


def _read_parquet(path: Path) -> NamesAndColumns:
    metadata = pq.read_metadata(path)
    _check_size(path, metadata)
    stored = (metadata.schema.column(i) for i in range(metadata.num_columns))
    texts = [column.path for column in stored if column.physical_type == "BYTE_ARRAY"]
    with pq.ParquetFile(path, metadata=metadata, read_dictionary=texts) as file:
        names = [name for name in file.schema_arrow.names if name in KNOWN or name in LISTS]
        table = file.read(names)
        # Of other columns the names alone are told where one is missing.
        others = [name for name in file.schema_arrow.names if name not in names]
        index = _pandas_index(file.schema_arrow.metadata, file.metadata.num_rows)
    header, values = _without_lists(path, table)
    if index is not None and FRAME not in header:
        header, values = [FRAME, *header], [index, *values]
    return [*header, *others], [*values, *([] for _ in others)]


def _check_size(path: Path, metadata: pq.FileMetaData) -> None:
    """Refuse a file before anything of it is unpacked: a small one may unpack to more than memory can hold.

    Raises:
        UserError: too many rows, values in lists, or bytes.
    """
    check_rows(path, metadata.num_rows)
    groups = (metadata.row_group(i) for i in range(metadata.num_row_groups))
    columns = [group.column(i) for group in groups for i in range(group.num_columns)]
    unpacked = sum(max(0, column.total_uncompressed_size) for column in columns)
    if unpacked > MOST_BYTES or any(column.num_values > len(VECTOR) * MOST_ROWS for column in columns):
        raise UserError(f"{path} unpacks to {unpacked // 10**6} MB; give --poses a file with a row for each image")


def _without_lists(path: Path, table: pa.Table) -> NamesAndColumns:
    """Names and columns, those with a vector of three numbers in a row as three columns."""
    header: list[str] = []
    values: list[list[Any]] = []
    for name, column in zip(table.column_names, table.columns, strict=True):
        if pa.types.is_dictionary(column.type):  # a long text is stored once, and stands in every row
            if total_bytes(column) > MOST_TEXT_BYTES:
                raise UserError(f"{path}: the texts of {name} have more than {MOST_TEXT_BYTES // 10**6} MB; mend them")
            column = column.cast(column.type.value_type)
        rows = column.to_pylist()
        if name not in LISTS:
            header, values = [*header, name], [*values, rows]
            continue
        wrong = next((i for i, row in enumerate(rows, 1) if row is not None and not _is_vector(row)), None)
        if wrong is not None:
            raise UserError(f"{path}, row {wrong}: {name} is no list of three numbers; mend it")
        header += LISTS[name]
        values += [[None if row is None else row[axis] for row in rows] for axis in range(3)]
    return header, values


def _is_vector(row: Any) -> bool:
    return isinstance(row, list) and len(row) == len(VECTOR)


def _pandas_index(metadata: Mapping[bytes, bytes] | None, rows: int) -> list[int] | None:
    """Values of an index called frame_id of which pandas keeps only start, stop and step; other ones are columns."""
    try:
        described = json.loads((metadata or {}).get(b"pandas", b"{}"))["index_columns"]
        kept = next(item for item in described if isinstance(item, dict) and item.get("name") == FRAME)
        index = range(int(kept["start"]), int(kept["stop"]), int(kept["step"]))
        return list(index) if len(index) == rows else None
    except (LookupError, TypeError, ValueError, StopIteration, OverflowError, RecursionError):
        return None


def read_csv(path: Path) -> NamesAndColumns:
    """A CSV file's header and columns.

    `csv` reads it and not `pyarrow.csv`, which guesses types (`true` becomes 1, text that is not UTF-8 becomes bytes, a
    wrong number a column of text), keeps blanks before names and quotes, and counts lines without the empty ones: it
    could not say which value of which line is wrong.

    Raises:
        UserError: too many rows, or a row with another number of values than the header.
    """
    with open(path, encoding="utf-8-sig", newline="") as file:
        lines = csv.reader(file, skipinitialspace=True)
        first, rows = next(lines, []), list(itertools.islice(lines, MOST_ROWS + 1))
    check_rows(path, len(rows))
    header = [name.strip() for name in first]
    return header, _transposed(path, header, rows)


def check_rows(path: Path, count: int) -> None:
    """Refuse files with too many rows.

    Raises:
        UserError: more than MOST_ROWS.
    """
    if count > MOST_ROWS:
        raise UserError(f"{path} has more than {MOST_ROWS} rows; give --poses a file with a row for each image")


READERS: dict[str, Reader] = {".parquet": _read_parquet, ".csv": read_csv}


def _transposed(path: Path, header: list[str], rows: list[list[str]]) -> list[list[Any]]:
    """Columns of a CSV file's rows; empty lines are skipped."""
    for line, row in enumerate(rows, 2):
        if row and len(row) != len(header):
            raise UserError(f"{path}, line {line} has {len(row)} values under {len(header)} columns; mend that line")
    filled = [row for row in rows if row]
    return [[row[i] for row in filled] for i in range(len(header))]


def _first_line(error: Exception) -> str:
    return str(error).split("\n")[0].rstrip(".")
