"""Footers of Parquet files read from their bytes, whole and damaged."""

import random

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datasets.store.parquet_footer import FooterError, stored_columns

NUMBERS = {"PLAIN": 0, "PLAIN_DICTIONARY": 2, "RLE": 3, "BIT_PACKED": 4, "DELTA_BINARY_PACKED": 5, "RLE_DICTIONARY": 8}


@pytest.fixture
def path(tmp_path):
    rows = pa.table(
        {
            "frame_id": list(range(2000)),
            "status": ["ok", "lost"] * 1000,
            "image": [{"bytes": b"x" * 50, "path": None}] * 2000,
            "covariance": [[0.5] * 3] * 2000,
        }
    )
    encodings = {"frame_id": "DELTA_BINARY_PACKED"}
    path = tmp_path / "rows.parquet"
    pq.write_table(
        rows, path, use_dictionary=["status", "image.bytes"], column_encoding=encodings, row_group_size=700,
        write_page_index=True,
    )  # fmt: skip
    return path


def test_columns_are_those_that_pyarrow_tells(path):
    footer = pq.read_metadata(path)
    told = [footer.row_group(i).column(k) for i in range(footer.num_row_groups) for k in range(footer.num_columns)]
    found = stored_columns(path)
    assert [column.name for column in found] == [column.path_in_schema for column in told]
    assert [column.values for column in found] == [column.num_values for column in told]
    assert [column.uncompressed_bytes for column in found] == [column.total_uncompressed_size for column in told]
    assert [column.has_dictionary for column in found] == [column.has_dictionary_page for column in told]
    assert [column.encodings for column in found] == [{NUMBERS[name] for name in column.encodings} for column in told]


def test_a_damaged_footer_is_read_or_refused(path):
    """At any byte, and cut off anywhere: pyarrow would end the process for some of them."""
    data, rng = path.read_bytes(), random.Random(0)
    length = int.from_bytes(data[-8:-4], "little")
    refused = 0
    for _ in range(300):
        damaged = bytearray(data)
        damaged[-8 - rng.randrange(length)] ^= 1 << rng.randrange(8)
        path.write_bytes(damaged)
        try:
            stored_columns(path)
        except FooterError:
            refused += 1
    assert refused > 30
    for cut in (0, 3, 8, 12, length // 2):
        path.write_bytes(data[:cut])
        with pytest.raises(FooterError):
            stored_columns(path)


def test_nesting_without_end_is_refused(path):
    footer = b"\x49" + b"\x19" * 5000
    path.write_bytes(b"PAR1" + footer + len(footer).to_bytes(4, "little") + b"PAR1")
    with pytest.raises(FooterError, match="nested"):
        stored_columns(path)
