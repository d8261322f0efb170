"""What is gathered shard by shard is what all rows at once give."""

import numpy as np

from datasets.store.dataset import open_dataset
from pipelines.report.data import SCORE_COLUMNS, series
from pipelines.report.gather import gathered
from pipelines.report.point_tables import field_rows, tallied, tilt_rows
from pipelines.report.points import point_errors


def same(one, other):
    """Whether two rows tell the same; sums over parts are rounded otherwise."""
    assert one.keys() == other.keys()
    for name, value in one.items():
        if isinstance(value, float):
            np.testing.assert_allclose(value, other[name], rtol=1e-12)
        else:
            assert value == other[name]


def test_shard_by_shard_gives_the_tables_of_all_points_at_once(tiny):
    dataset = open_dataset(tiny[1])
    assert len(dataset.shards("frames")) == 2
    run, points = gathered(dataset)
    columns = ["frame_id", "camera_name", "tilt_deg", "cx_px", "cy_px"]
    frames = dataset.read("frames", columns).to_pylist()
    whole = [tallied(item, frames) for item in point_errors(dataset, frames)]
    assert [row["frame_id"] for row in run.frames] == [row["frame_id"] for row in frames]
    for table in (tilt_rows, field_rows):
        rows, wanted = table(points, run.frames), table(whole, frames)
        assert len(rows) == len(wanted) > 0
        for row, other in zip(rows, wanted, strict=True):
            same(row, other)


def test_shard_by_shard_gives_the_scores_of_the_whole_table(tiny):
    dataset = open_dataset(tiny[1])
    run, _ = gathered(dataset)
    whole = series([dataset.read("scores", list(SCORE_COLUMNS))])
    assert [item.name for item in run.found] == [item.name for item in whole]
    for item, other in zip(run.found, whole, strict=True):
        np.testing.assert_array_equal(item.frame_id, other.frame_id)
        np.testing.assert_array_equal(item.status, other.status)
        np.testing.assert_array_equal(item.normalised, other.normalised)
        for name, values in item.errors.items():
            np.testing.assert_array_equal(values, other.errors[name])
