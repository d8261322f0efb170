"""Identity counts what a reader can tell apart, and nothing else."""

from __future__ import annotations

import itertools
import struct

import numpy as np
import pyarrow as pa
import pytest

from datasets.schema import DETECTIONS, ESTIMATES
from datasets.store.digest import combined_digest, table_digest
from datasets.store.images import encode_png
from datasets.store.nulls import with_nulls

IMAGE = pa.struct([pa.field("bytes", pa.binary()), pa.field("path", pa.string())])
PIXELS = np.arange(48, dtype=np.uint8).reshape(6, 8)


def digest(values, kind=None, name="x"):
    return table_digest(pa.table({name: pa.array(values, kind)}))


def nan(payload, sign=0):
    """A quiet NaN whose bits are not those of others."""
    return struct.unpack("<d", struct.pack("<Q", sign << 63 | 0x7FF8000000000000 | payload))[0]


def test_every_nan_and_a_null_are_one():
    values = np.array([nan(0), nan(1), nan(12345, sign=1)])
    assert len(set(values.view(np.uint64).tolist())) == 3
    assert len({digest([1.0, value]) for value in values}) == 1
    assert digest([1.0, None]) == digest([1.0, values[1]])
    assert digest([1.0, np.nan]) != digest([1.0, 0.0])


def test_zero_has_no_sign():
    assert digest([0.0, 1.0]) == digest([-0.0, 1.0])
    assert digest([0.0, 1.0]) != digest([5e-324, 1.0])


@pytest.mark.parametrize("of_list", [False, True], ids=["number", "list"])
def test_lists_are_as_canonical_as_numbers(of_list):
    kind = ESTIMATES.field("covariance").type if of_list else pa.float64()
    make = (lambda value: [[value] * 36, [1.0] * 36]) if of_list else (lambda value: [value, 1.0])
    assert digest(make(0.0), kind) == digest(make(-0.0), kind)
    assert digest(make(nan(0)), kind) == digest(make(nan(7)), kind)
    table = pa.table({"x": pa.array(make(np.nan), kind)})
    assert with_nulls(table)["x"].null_count == 1
    assert table_digest(with_nulls(table)) == table_digest(table)


def test_lists_of_any_length_count_by_their_lengths_and_values():
    kind = DETECTIONS.field("joint_factor_px").type
    lists = ([[1.0, 2.0], None, [3.0]], [[1.0], None, [2.0, 3.0]], [[1.0, 2.0], [], [3.0]], [[1.0, 2.0], None, [4.0]])
    assert len({digest(values, kind) for values in lists}) == 4
    assert digest([[0.0]], kind) == digest([[-0.0]], kind)
    whole = pa.table({"x": pa.array(lists[0], kind)})
    assert table_digest(pa.concat_tables([whole.slice(0, 1), whole.slice(1)])) == table_digest(whole)


def test_the_type_counts():
    """Equal values of several types are several contents."""
    numbers = [digest([0, 1], kind) for kind in (pa.int32(), pa.int64(), pa.float32(), pa.float64())]
    assert len({*numbers, digest([False, True])}) == 5


def test_name_order_length_and_values_count():
    tables = (
        pa.table({"x": [1.0, 2.0]}),
        pa.table({"y": [1.0, 2.0]}),
        pa.table({"x": [2.0, 1.0]}),
        pa.table({"x": [1.0]}),
        pa.table({"x": [1.0, 2.0], "y": [1.0, 2.0]}),
        pa.table({"y": [1.0, 2.0], "x": [1.0, 2.0]}),
    )
    assert len({table_digest(table) for table in tables}) == len(tables)


def test_nulls_are_no_values():
    columns = (["a", None], ["a", ""], ["a", "None"], [None, "a"], ["a", "\0"])
    assert len({digest(column, pa.string()) for column in columns}) == len(columns)
    assert len({digest(column, pa.int32()) for column in ([0, None], [None, 0], [0, 0])}) == 3
    assert len({digest(column, pa.bool_()) for column in ([False, None], [None, False], [False, False])}) == 3


def test_chunks_and_descriptions_do_not_count():
    whole = pa.table({"x": [1.0, np.nan, 3.0]})
    parts = pa.concat_tables([whole.slice(0, 1), whole.slice(1)])
    told = whole.replace_schema_metadata({"date": "today"})
    assert table_digest(whole) == table_digest(parts) == table_digest(told)


def test_an_image_counts_by_its_pixels():
    import cv2

    ours, theirs = encode_png(PIXELS), cv2.imencode(".png", PIXELS, [cv2.IMWRITE_PNG_COMPRESSION, 9])[1].tobytes()
    other = encode_png(PIXELS[::-1].copy())
    turned = encode_png(PIXELS.reshape(8, 6))
    assert ours != theirs
    found = [digest([{"bytes": data, "path": name}], IMAGE) for data, name in zip((ours, theirs), "ab", strict=True)]
    assert found[0] == found[1]
    assert len({found[0], *(digest([{"bytes": data, "path": "a"}], IMAGE) for data in (other, turned))}) == 3


def test_a_type_without_a_form_is_refused():
    with pytest.raises(TypeError, match="has no canonical form"):
        digest([[1], [2]], pa.list_(pa.int64()))


def test_the_hash_stays_what_it_was():
    """Datasets on disk carry it: version 2 of the tables gave this hash to this table."""
    table = pa.table(
        {
            "frame_id": pa.array([0, 1], pa.int64()),
            "status": ["ok", "not_converged"],
            "t_x_mm": [-0.0, np.nan],
            "covariance": pa.array([[1.0] * 36, [np.nan] * 36], ESTIMATES.field("covariance").type),
            "gross_failure": [False, True],
            "image": pa.array([{"bytes": encode_png(PIXELS), "path": "0.png"}] * 2, IMAGE),
        }
    )
    assert table_digest(table) == "1ec4fbdd9188e3bf7c756e13be67d65a88bdb11a3d00c83209d2b448ecd421b4"


def test_parts_count_by_name_and_order():
    parts = [("a", "1"), ("b", "2")]
    found = {combined_digest("r", order) for order in itertools.permutations(parts)}
    assert len(found | {combined_digest("s", parts), combined_digest("r", [("a", "1"), ("c", "2")])}) == 4
