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
