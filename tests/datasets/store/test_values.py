"""Shards with right digests and wrong content are refused by who reads them, whoever wrote them."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from datasets.errors import UserError
from datasets.schema import TABLES
from datasets.store.dataset import open_dataset
from datasets.verify import verify
from tests.hostile.kinds.tables import write, write_bomb
from tests.wrong_input import doctor, first

ONE = "best-detected-exact-all-00000-of-00002.parquet"


def column(name, value):
    """A change of a whole column."""

    def change(rows):
        field = rows.schema.field(name)
        return rows.set_column(rows.column_names.index(name), field, pa.array([value] * rows.num_rows, field.type))

    return change


CASES = {
    "infinite": ("estimates", column("reprojection_rmse_px", np.inf), "reprojection_rmse_px has a number beyond"),
    "huge": ("scores", column("tx_normalised", 1e300), "tx_normalised has a number beyond 1e\\+75"),
    "huge covariance": ("estimates", column("covariance", [1e200] * 36), "covariance has a number beyond"),
    "infinite factor": ("detections", column("joint_factor_px", [np.inf, 1.0]), "has what is no number"),
    "factor with a hole": ("detections", column("joint_factor_px", [None, 1.0]), "has what is no number"),
    "odd factor": ("detections", column("joint_factor_px", [1.0]), "are not matrices of two rows"),
    "empty factor": ("detections", column("joint_factor_px", []), "are not matrices of two rows"),
    "no status": ("estimates", column("status", None), "status has a row without a value"),
    "no flag": ("scores", column("gross_failure", None), "gross_failure has a row without a value"),
    "long text": ("estimates", column("status", "x" * 1001), "status has a text of more than 1000 letters"),
    "ok without a pose": ("estimates", column("t_x_mm", None), "status is ok and whose t_x_mm has no value"),
    "ok without a point": ("detections", column("x_px", None), "status is ok and whose x_px has no value"),
    "ok without an error": ("scores", column("rotation_error_deg", None), "rotation_error_deg has no value"),
    "no rotation": ("estimates", column("q_w", 0.5), "a quaternion whose length is not 1"),
    "another solver": ("scores", column("solver", "eposit"), "of another solver, points, camera or use"),
    "another detector": ("detections", column("detector", None), "without a value"),
    "another draw": ("estimates", column("noise_draw", 1), "every draw from 0 to 0"),
    "another camera": ("frames", column("fx_px", 400.0), "its fx_px is not what the recipe plans"),
    "another lens": ("frames", column("lens", "equisolid"), "its lens is not what the recipe plans"),
    "another coefficient": ("frames", column("k2", 0.1), "its k2 is not what the recipe plans"),
    "another nominal camera": ("frames", column("nominal_f_px", 1.0), "its nominal_f_px is not what the recipe plans"),
    "another region": ("frames", column("region_width_px", 2**31 - 1), "its region lies outside the picture"),
    "another truth": ("keypoints", column("x_px", 5.0), "its x_px is not what the recipe plans"),
    "no picture": ("frames", column("image", {"bytes": None, "path": None}), "a row without a picture"),
    "another format": (
        "frames",
        column("image", {"bytes": b"GIF89a", "path": None}),
        "frame 0: the image is not an 8-bit PNG",
    ),
    "another row": ("estimates", lambda rows: pa.concat_tables([rows, rows]), "its rows are not those of frames"),
}


def place_of(root, table):
    return root / table / ONE if table in ("estimates", "scores") else first(root, table)


@pytest.mark.parametrize("name", CASES)
def test_a_doctored_shard_is_refused(name, root):
    table, change, words = CASES[name]
    path = place_of(root, table)
    if name == "no picture":
        rows = pq.read_table(path).replace_schema_metadata(None)
        footer = {key.decode(): value.decode() for key, value in pq.read_metadata(path).metadata.items()}
        write(path, change(rows), footer)
    else:
        doctor(path, change)
    dataset = open_dataset(root)
    with pytest.raises(
        UserError, match=f"{path.name} is damaged: .*{words}" if name != "no picture" else "is damaged: "
    ):
        dataset.read_shard(path)
    assert path in [problem.path for problem in verify(dataset)[1]]


def test_two_detectors_in_one_shard(root):
    path = first(root, "detections")
    doctor(path, lambda rows: pa.concat_tables([rows.slice(0, 9), column("detector", "x")(rows.slice(9))]))
    with pytest.raises(UserError, match="its rows are of another detector than its name tells"):
        open_dataset(root).read_shard(path)


@pytest.mark.parametrize("of_text", [True, False])
def test_a_small_file_that_unpacks_to_gigabytes_is_not_unpacked(of_text, root):
    path = place_of(root, "estimates")
    footer = {key.decode(): value.decode() for key, value in pq.read_metadata(path).metadata.items()}
    write_bomb(path, TABLES["estimates"], footer, of_text)
    assert path.stat().st_size < 1_000_000
    before = pa.total_allocated_bytes()
    with pytest.raises(UserError, match=r"a text of more than 4000 bytes|rows, and 1 are planned"):
        open_dataset(root).read_shard(path)
    assert pa.total_allocated_bytes() - before < 10_000_000


def test_encodings_that_hold_more_than_their_size_are_refused(root):
    path = place_of(root, "scores")
    rows = pq.read_table(path)
    options = {"use_dictionary": False, "column_encoding": {"status": "DELTA_BYTE_ARRAY"}}
    pq.write_table(rows, path, **options)
    with pytest.raises(UserError, match="its status is stored as this program never does"):
        open_dataset(root).read_shard(path)
