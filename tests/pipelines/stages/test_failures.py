"""A failed score says why there is no pose, down to what detection says of the points."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datasets.rows import poses
from datasets.schema import ESTIMATES, TABLES
from datasets.store.dataset import open_dataset
from datasets.store.images import encode_png
from pipelines.detection import Detector
from pipelines.stages.failures import failure_reasons
from pipelines.stages.settings import Setting, detector_of
from tests.wrong_input import put_image


def scores_of(root, variant):
    rows = [row for path in sorted((root / "scores").glob(f"{variant}-0*")) for row in pq.read_table(path).to_pylist()]
    return [(row["status"], row["failure_reason"]) for row in rows]


def test_a_board_that_is_not_found_is_the_reason(place, cli):
    root = place.dataset(without=["detections", "estimates", "scores"])
    put_image(root, encode_png(np.full((300, 400), 90, np.uint8)))
    assert cli("detect", root, "-q").code == 0
    assert cli("detect", root, "-q", "--detector", "opencv-subpix").code == 0
    assert cli("estimate", root, "-q").code == 0
    assert cli("estimate", root, "-q", "--use", "four", "--detector", "opencv-subpix").code == 0
    assert cli("score", root, "-q").code == 0
    assert scores_of(root, "best-detected-exact-all") == [("points_missing", "board_not_found"), ("ok", None)]
    assert scores_of(root, "best-detected-opencv-subpix-exact-four")[0] == ("points_missing", "board_not_found")


def rewritten(dataset, table, change):
    """Change the rows of a table's first shard."""
    path = dataset.shards(table)[0]
    rows = dataset.read_shard(path).to_pylist()
    for row in rows:
        change(row)
    dataset.write_shard(path, pa.Table.from_pylist(rows, schema=TABLES[table]))


def test_of_four_points_those_that_are_missing_count(root):
    """The circle and a corner of the four are lost, and so is another corner: the four have two reasons, all three."""
    dataset = open_dataset(root)
    four = dataset.recipe.four_indices()
    other = next(i for i in range(len(dataset.recipe.target.points)) if i not in four)
    lost = {four[-1]: "circle_not_found", four[1]: "corners_inconsistent", other: "board_not_found"}

    def lose(row):
        row["status"] = lost.get(row["point_id"], "ok")

    rewritten(dataset, "detections", lose)
    estimates = dataset.shards("estimates")[0]
    template = dataset.read_shard(estimates).to_pylist()[0]
    for chosen, reason in (
        ("four", "circle_not_found, corners_inconsistent"),
        ("all", "board_not_found, circle_not_found, corners_inconsistent"),
    ):
        row = template | {"status": "points_missing", "point_set": chosen}
        rows = pa.Table.from_pylist([row], schema=ESTIMATES)
        assert failure_reasons(dataset, estimates, rows) == [reason]


@pytest.mark.parametrize(
    ("source", "status", "reason"),
    [
        ("detected", "ok", None),
        ("detected", "not_converged", "not_converged"),
        ("truth", "points_missing", "beyond_lens"),
        ("truth+0.4px", "points_missing", "beyond_lens"),
        ("image", "the dog ate it", "the dog ate it"),
    ],
)
def test_other_reasons_need_no_detections(source, status, reason, root):
    dataset = open_dataset(root)
    for path in dataset.shards("detections"):
        path.unlink()
    estimates = dataset.shards("estimates")[0]
    row = dataset.read_shard(estimates).to_pylist()[0] | {"status": status, "point_source": source}
    assert failure_reasons(dataset, estimates, pa.Table.from_pylist([row], schema=ESTIMATES)) == [reason]


@pytest.mark.parametrize("detector", Detector)
def test_a_name_of_points_tells_their_detector(detector):
    assert detector_of(Setting(detector=detector).points_name) == detector
    assert detector_of(Setting(points="truth", detector=detector).points_name) is None
    assert detector_of(Setting(points="truth+noise", detector=detector).points_name) is None


def test_the_place_of_the_board_is_the_frames(root):
    """Angles and distance by another way: the tilt is the frames' own, the board's centre by its angles."""
    dataset = open_dataset(root)
    scores, frames = dataset.read("scores").to_pylist(), dataset.read("frames").to_pylist()
    true = poses(dataset.read("frames"))
    centre = np.array([400.0, 250.0, 0.0])  # of 10 x 7 squares of 100 mm, from the first inner corner
    assert [row["tilt_deg"] for row in scores] == [frame["tilt_deg"] for frame in frames]
    for i, row in enumerate(scores):
        x, y, z = true.R[i] @ centre + true.t[i]
        assert row["distance_mm"] == pytest.approx(np.sqrt(x * x + y * y + z * z), rel=1e-12)
        assert row["field_deg"] == pytest.approx(np.degrees(np.arccos(z / row["distance_mm"])), abs=1e-9)


def hide(dataset, points):
    """Hide some points of the first frame, and say that the others are visible."""

    def put(row):
        row["visible"] = row["point_id"] not in points

    rewritten(dataset, "keypoints", put)


def rescored(root, cli):
    """Status, reason and gross failure of the first frame, by our solver on detected points."""
    for path in (root / "scores").glob("*.parquet"):
        path.unlink()
    assert cli("score", root, "-q").code == 0
    path = min((root / "scores").glob("best-detected-exact-all-0*"))
    row = pq.read_table(path).to_pylist()[0]
    return row["status"], row["failure_reason"], row["gross_failure"]


@pytest.mark.usefixtures("no_figures")
def test_a_pose_of_a_hidden_target_is_made_up(root, cli):
    dataset, count = open_dataset(root), len(open_dataset(root).recipe.target.points)
    hide(dataset, range(4, count))  # four points are left: a pose can be made
    assert rescored(root, cli) == ("ok", None, False)
    hide(dataset, range(3, count))
    assert rescored(root, cli) == ("ok", None, True)
    assert cli("report", root).code == 0
    assert "cannot be seen" in (root / "report.html").read_text()


def test_what_is_hidden_is_not_missed(root, cli):
    dataset, count = open_dataset(root), len(open_dataset(root).recipe.target.points)

    def lose(row):
        row["status"] = "board_not_found"
        row |= dict.fromkeys(("x_px", "y_px", "var_x_px2", "cov_xy_px2", "var_y_px2"))

    def fail(row):
        row["status"] = "points_missing"
        row |= {name: None for name in row if name.startswith(("q_", "t_"))}

    rewritten(dataset, "detections", lose)
    rewritten(dataset, "estimates", fail)
    hide(dataset, range(count))
    assert rescored(root, cli) == ("points_missing", "hidden", False)
    hide(dataset, range(10, count))
    assert rescored(root, cli) == ("points_missing", "board_not_found, hidden", True)
