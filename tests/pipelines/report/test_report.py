"""The report: self-contained, and its tables are the scores."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.rows import of_detector
from datasets.store.dataset import open_dataset
from datasets.store.images import decode_png
from pipelines.report.data import ERRORS, Series, cells, normalised_rows, series
from pipelines.report.page import REPORT, write_report
from pipelines.report.point_tables import field_rows, tallied, tilt_rows
from pipelines.report.points import point_errors
from tests.pipelines.pages.parsed import Page, assert_named_for_a_screen_reader


def test_report_is_one_file_without_the_network(reported):
    text = (reported / REPORT).read_text()
    page = Page(text)
    addresses = [item.attributes[name] for item in page.all for name in ("href", "src") if name in item.attributes]
    assert all(address.startswith(("#", "data:image/jpeg;base64,")) for address in addresses)
    assert not [item for item in page.all if any(name.startswith("on") or name == "style" for name in item.attributes)]
    titles = [item.text for item in page.of("h2")]
    assert titles == [
        "Summary", "One frame of each camera", "Frames to look at", "Detection", "Poses", "Errors frame by frame",
        "What was run",
    ]  # fmt: skip


def test_equal_data_give_equal_bytes(root):
    dataset = open_dataset(root)
    first, second = (write_report(dataset).read_bytes() for _ in range(2))
    assert first == second


def test_everything_has_a_name_for_a_screen_reader(reported):
    assert_named_for_a_screen_reader(Page((reported / REPORT).read_text()))


def test_frames_are_shown_with_what_makes_them_again(reported, cli, tmp_path):
    root = reported
    page = Page((root / REPORT).read_text())
    usual, worst = page.of("ul", "frames")
    assert len(page.inside(usual, "li")) == 1  # one of each camera
    assert len(page.inside(worst, "li")) == 2  # all, as there are two
    command = page.inside(worst, "code", "command")[0].text
    words = command.replace("DATASET", str(root)).split()
    assert words[:4] == ["python", "-m", "pipelines", "frame"]
    out = tmp_path / words[-1]
    done = cli(*words[3:-1], out)
    assert done.code == 0
    told = page.inside(worst, "figcaption")[0].text
    assert told.startswith("55 of 55 points, RMS 0.0")
    assert "54 of 54 corners, mean error " in done.out
    stored = {row["frame_id"]: row["image"]["bytes"] for row in open_dataset(root).read("frames").to_pylist()}
    np.testing.assert_array_equal(decode_png(out.read_bytes()), decode_png(stored[int(words[5])]))
    assert "has no frame 2; give a number from 0 to 1" in cli("frame", root, 2, "--out", out).err


def test_failures_are_counted_and_kept_out_of_medians(tiny):
    _, root = tiny
    dataset = open_dataset(root)
    scores = dataset.read("scores")
    frames = dataset.read("frames", ["frame_id", "camera_name", "tilt_deg"]).to_pylist()
    cameras = {frame["frame_id"]: frame["camera_name"] for frame in frames}
    found = series([scores])
    rows = cells(found, cameras)
    assert sum(row.n for row in rows) == scores.num_rows
    for item in found:
        assert np.isnan(item.errors["rotation_error_deg"][item.failed]).all()
        assert np.all(item.gross[item.failed])
    for row in rows:
        for score in (row.rotation_deg, row.position_mm, *(error.median for error in row.errors)):
            assert score.low <= score.value <= score.high
        assert row.failed_rate.value == row.failed / row.n
    broken = found[0]
    broken.status[:] = "not_converged"
    for row in cells([broken], cameras):
        assert (row.rotation_deg, row.position_mm, row.errors) == (None, None, ())
        assert row.failed == row.n


def test_poses_that_are_ambiguous_or_unreliable_are_counted_apart():
    item = _series(4, 2, np.arange(4.0))
    ambiguous, unreliable = (np.isin(np.arange(8), rows) for rows in ([1], [0, 1, 5]))
    rows = cells([replace(item, ambiguous=ambiguous, unreliable=unreliable)], {0: "a", 1: "a", 2: "b", 3: "b"})
    assert [(row.ambiguous, row.unreliable) for row in rows] == [(1, 2), (0, 1)]


def _series(n, draws, values):
    errors = {column: np.repeat(values, draws) for column in ERRORS}
    frame = np.repeat(np.arange(n), draws)
    status, never = np.full(len(frame), "ok"), np.zeros(len(frame), bool)
    return Series("x", {}, frame, errors, np.full((len(frame), 6), np.nan), status, never, never, never)


def test_draws_of_one_frame_stay_together_in_the_intervals():
    (row,) = cells([_series(4, 25, [1.0, 2.0, 3.0, 4.0])], dict.fromkeys(range(4), "a"))
    # Of four frames some samples lack the middle two; of a hundred values that would never happen.
    assert (row.rotation_deg.low, row.rotation_deg.high) == (1.0, 4.0)


@pytest.mark.parametrize(("frames", "told"), [(71, False), (72, True)])
def test_a_95th_percentile_is_told_from_72_frames(frames, told):
    (row,) = cells([_series(frames, 3, np.arange(1.0, frames + 1.0))], dict.fromkeys(range(frames), "a"))
    assert all((error.tail is not None) == told for error in row.errors)
    assert [error.label for error in row.errors if error.mean is not None] == [
        "rx, deg", "ry, deg", "rz, deg", "x, mm", "y, mm", "z, mm",
    ]  # fmt: skip


FRAME_COLUMNS = ["frame_id", "camera_name", "tilt_deg", "cx_px", "cy_px"]


def test_detection_tables_count_every_board_and_corner(tiny):
    _, root = tiny
    dataset = open_dataset(root)
    frames = dataset.read("frames", FRAME_COLUMNS).to_pylist()
    errors = point_errors(dataset, frames)
    points = [tallied(item, frames) for item in errors]
    rows, corners = tilt_rows(points, frames), field_rows(points, frames)
    assert [item.detector for item in errors] == ["edge-fit"]
    assert sum(row["frames"] for row in rows) == len(frames)
    assert all(row["boards"] <= row["frames"] for row in rows)
    assert sum(row["corners"] for row in corners) == np.sum(errors[0].in_image[:, :-1])


def test_points_whose_angle_is_not_known_are_in_no_band(tiny):
    dataset = open_dataset(tiny[1])
    frames = dataset.read("frames", FRAME_COLUMNS).to_pylist()
    errors = point_errors(dataset, frames)[0]
    unknown = replace(errors, theta_deg=np.full_like(errors.theta_deg, np.nan))
    assert field_rows([tallied(unknown, frames)], frames) == []


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
    names = [row["setting"] for row in normalised_rows(series(open_dataset(root).each_shard("scores")))]
    assert "best detected exact all" in names
    assert not any(name.startswith("eposit") or " truth " in name for name in names)
