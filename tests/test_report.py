"""The report: self-contained, and its tables are the scores."""

import re

import numpy as np

from datasets.store import open_dataset
from pipelines.report.data import detection_rows, score_rows, series
from pipelines.report.page import REPORT, write_report


def test_report_is_one_file_without_the_network(tiny):
    _, root = tiny
    text = (root / REPORT).read_text()
    assert "<script" not in text
    # Addresses appear as names of XML vocabularies only; nothing is loaded from one.
    assert not re.findall(r'(?:src|href)="(?!data:|#)[^"]*"', text)
    for part in ("Pictures", "Detection", "Poses", "What was run", "data:image/png;base64,", "best detected exact all"):
        assert part in text
    before = text
    write_report(open_dataset(root))
    assert (root / REPORT).read_text() == before  # equal data, equal bytes


def test_failures_are_counted_and_kept_out_of_medians(tiny):
    _, root = tiny
    dataset = open_dataset(root)
    scores = dataset.read("scores")
    frames = dataset.read("frames", ["frame_id", "camera_name", "tilt_deg"]).to_pylist()
    cameras = {frame["frame_id"]: frame["camera_name"] for frame in frames}
    found = series(scores)
    rows = score_rows(found, cameras)
    assert sum(row["n"] for row in rows) == scores.num_rows
    for item in found:
        assert np.isnan(item.errors["rotation_error_deg"][item.failed]).all()
        assert np.all(item.star[item.failed])
    broken = found[0]
    broken.failed[:] = True
    assert all(row["rotation_error_deg"] is None for row in score_rows([broken], cameras))
    assert sum(row["failed"] for row in score_rows([broken], cameras)) == len(broken.failed)


def test_detection_table_counts_boards(tiny):
    _, root = tiny
    dataset = open_dataset(root)
    frames = dataset.read("frames", ["frame_id", "camera_name", "tilt_deg"]).to_pylist()
    rows = detection_rows(dataset, frames)
    assert sum(row["frames"] for row in rows) == len(frames)
    assert all(row["boards"] <= row["frames"] for row in rows)
