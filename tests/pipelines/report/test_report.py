"""The report: self-contained, and its tables are the scores."""

import re

import numpy as np

from datasets.rows import of_detector
from datasets.store.dataset import open_dataset
from pipelines.report.data import ERRORS, Series, normalised_rows, score_rows, series
from pipelines.report.page import REPORT, write_report
from pipelines.report.points import field_rows, point_errors, tilt_rows


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
        assert np.all(item.gross[item.failed])
    for row in rows:
        for score in row["rotation_error_deg"] or ():
            assert score.low <= score.value <= score.high
        assert row["failed_rate"].value == row["failed"] / row["n"]
    broken = found[0]
    broken.failed[:] = True
    assert all(row["rotation_error_deg"] is None for row in score_rows([broken], cameras))
    assert sum(row["failed"] for row in score_rows([broken], cameras)) == len(broken.failed)


def test_draws_of_one_frame_stay_together_in_the_intervals():
    errors = {column: np.repeat([1.0, 2.0, 3.0, 4.0], 25) for column in ERRORS}
    frame, never = np.repeat([7, 8, 9, 10], 25), np.zeros(100, bool)
    (row,) = score_rows(
        [Series("x", frame, errors, np.full((100, 6), np.nan), never, never)], dict.fromkeys((7, 8, 9, 10), "a")
    )
    # Of four frames some samples lack the middle two; of a hundred values that would never happen.
    assert (row["rx_error_deg"][0].low, row["rx_error_deg"][0].high) == (1.0, 4.0)


FRAME_COLUMNS = ["frame_id", "camera_name", "tilt_deg", "cx_px", "cy_px"]


def test_detection_tables_count_every_board_and_corner(tiny):
    _, root = tiny
    dataset = open_dataset(root)
    frames = dataset.read("frames", FRAME_COLUMNS).to_pylist()
    errors = point_errors(dataset, frames)
    rows, corners = tilt_rows(errors, frames), field_rows(errors, frames)
    assert [item.detector for item in errors] == ["edge-fit"]
    assert sum(row["frames"] for row in rows) == len(frames)
    assert all(row["boards"] <= row["frames"] for row in rows)
    assert sum(row["corners"] for row in corners) == np.sum(errors[0].in_image[:, :-1])


def test_point_errors_are_the_tables_differences(tiny):
    """Against a plain loop over the rows; directions against the true points' neighbours."""
    _, root = tiny
    dataset = open_dataset(root)
    frames = dataset.read("frames", FRAME_COLUMNS).to_pylist()
    item = point_errors(dataset, frames)[0]
    truth = dataset.read("keypoints").to_pylist()
    found = of_detector(dataset.read("detections"), "edge-fit").to_pylist()
    n = len(dataset.recipe.target.points)
    for row, (true, seen) in enumerate(zip(truth, found, strict=True)):
        frame, point = divmod(row, n)
        assert true["frame_id"] == frames[frame]["frame_id"] == seen["frame_id"]
        error = np.array([seen["x_px"] - true["x_px"], seen["y_px"] - true["y_px"]])
        np.testing.assert_array_equal(item.error[frame, point], error)
        radius = np.array([true["x_px"] - frames[frame]["cx_px"], true["y_px"] - frames[frame]["cy_px"]])
        radial = error @ radius / np.linalg.norm(radius)
        assert np.isnan(radial) or abs(item.radial[frame, point] - radial) < 1e-12
        covariance = np.array([[seen["var_x_px2"], seen["cov_xy_px2"]], [seen["cov_xy_px2"], seen["var_y_px2"]]])
        if np.all(np.isfinite(covariance)):
            squared = error @ np.linalg.solve(covariance, error)
            assert abs(np.sum(item.normalised[frame, point] ** 2) / squared - 1.0) < 1e-9


def test_normalised_errors_are_shown_where_they_are_stated(tiny):
    _, root = tiny
    names = [row["setting"] for row in normalised_rows(series(open_dataset(root).read("scores")))]
    assert "best detected exact all" in names
    assert not any(name.startswith("eposit") or " truth " in name for name in names)
