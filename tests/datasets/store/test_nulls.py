"""What is not there is null on disk and NaN in arrays, and nothing else changes."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import pytest

from datasets.rows import numbers, pose_covariances
from datasets.schema import ESTIMATES
from datasets.store.images import encode_png
from datasets.store.nulls import with_nans, with_nulls
from tests.tables import OF_A_RUN
from tests.wrong_input import put_image

LIST = ESTIMATES.field("covariance").type


def lists(values):
    return pa.FixedSizeListArray.from_arrays(pa.array(values.ravel()), type=LIST)


def test_nan_becomes_null_and_null_nan():
    covariance = np.arange(4.0 * 36.0).reshape(4, 36)
    covariance[1], covariance[2, 5] = np.nan, np.nan
    before = pa.table(
        {
            "number": [1.0, np.nan, -0.0, np.inf],
            "count": pa.array([1, 2, 3, 4], pa.int32()),
            "text": ["ok", "lost", "", "NaN"],
            "covariance": lists(covariance),
        }
    )
    after = with_nulls(before)
    assert after.schema == before.schema
    assert after["number"].to_pylist() == [1.0, None, 0.0, np.inf]
    assert after["covariance"][1].as_py() is None
    assert after["covariance"][2].as_py()[5] is None
    assert after["covariance"].null_count == 1
    assert after.select(["count", "text"]).equals(before.select(["count", "text"]))
    np.testing.assert_array_equal(with_nans(after["number"]), before["number"].to_numpy())
    np.testing.assert_array_equal(numbers(after, "number")[:, 0], before["number"].to_numpy())
    np.testing.assert_array_equal(pose_covariances(after).reshape(4, 36), covariance)


@pytest.mark.parametrize("start", [0, 1, 2])
def test_a_slice_of_a_column_has_its_own_values(start):
    values = np.arange(4.0 * 36.0).reshape(4, 36)
    values[1] = np.nan
    column = with_nulls(pa.table({"covariance": lists(values)}))["covariance"].slice(start)
    np.testing.assert_array_equal(with_nans(column), values[start:])


def test_averages_of_a_dataset_with_failures_are_numbers(place, cli):
    root = place.dataset(without=["detections", "estimates", "scores"])
    put_image(root, encode_png(np.full((300, 400), 90, np.uint8)))  # no board in it
    for words in (("detect",), ("estimate",), ("score",)):
        assert cli(*words, root, "-q").code == 0
    scores = pq.read_table(root / "scores")
    assert sorted(scores["status"].to_pylist()) == ["ok", "points_missing"]
    for name in OF_A_RUN:
        table = pq.read_table(root / name)
        for column, field in zip(table.columns, table.schema, strict=True):
            if pa.types.is_floating(field.type):
                assert not pc.any(pc.is_nan(column)).as_py(), (name, field.name)
    assert pc.mean(scores["rotation_error_deg"]).as_py() < 1.0
    assert pq.read_table(root / "estimates")["covariance"].null_count == 1
    assert cli("report", root).code == 0
