"""What other libraries read in a dataset: python other_readers.py DATASET EXPECTED LIBRARY.

It runs in an environment of theirs, and nothing of this project is imported. EXPECTED is an .npz file of what this
project reads: pixels (f, h, w), poses (f, 7), frame_id (f,) and errors (n,) of the scores with a pose.
"""

import io
import sys
from pathlib import Path

import numpy as np

POSE = ("q_w", "q_x", "q_y", "q_z", "t_x_mm", "t_y_mm", "t_z_mm")
ERROR = "rotation_error_deg"


def pixels_of(data):
    from PIL import Image

    return np.array(Image.open(io.BytesIO(data)))


def with_pyarrow(root):
    import pyarrow.compute as pc
    import pyarrow.parquet as pq

    frames, scores = pq.read_table(root / "frames"), pq.read_table(root / "scores")
    return frames.to_pylist(), scores.to_pylist(), pc.mean(scores[ERROR]).as_py()


def with_pandas(root):
    import pandas

    frames, scores = pandas.read_parquet(root / "frames"), pandas.read_parquet(root / "scores")
    rows = scores.astype(object).where(scores.notna(), None).to_dict("records")
    return frames.to_dict("records"), rows, scores[ERROR].mean()


def with_polars(root):
    import polars

    frames, scores = polars.read_parquet(root / "frames/*.parquet"), polars.read_parquet(root / "scores/*.parquet")
    return frames.to_dicts(), scores.to_dicts(), scores[ERROR].mean()


def with_duckdb(root):
    import duckdb

    def rows(table):
        found = duckdb.sql(f"select * from '{root}/{table}/*.parquet'")
        return [dict(zip(found.columns, row, strict=True)) for row in found.fetchall()]

    mean = duckdb.sql(f"select avg({ERROR}) from '{root}/scores/*.parquet'").fetchall()[0][0]
    return rows("frames"), rows("scores"), mean


def with_datasets(root):
    from datasets import load_dataset

    frames, scores = (load_dataset(str(root), name)["train"] for name in ("frames", "scores"))
    assert load_dataset(str(root))["train"].features == frames.features
    for name in ("keypoints", "detections", "estimates"):
        assert load_dataset(str(root), name)["train"].num_rows > 0
    errors = [value for value in scores[ERROR] if value is not None]
    return list(frames), list(scores), float(np.mean(errors))


def with_torch(root):
    import torch

    from datasets import load_dataset

    frames, scores = (load_dataset(str(root), name)["train"].with_format("torch") for name in ("frames", "scores"))
    rows = [
        {name: value.numpy() if isinstance(value, torch.Tensor) else value for name, value in row.items()}
        for row in frames
    ]
    errors = [None if row[ERROR] is None or torch.isnan(row[ERROR]) else float(row[ERROR]) for row in scores]
    mean = float(np.mean([error for error in errors if error is not None]))
    return rows, [{ERROR: error} for error in errors], mean


def check(library, root, expected):
    """The frames' pixels and poses, the scores' errors and their average are those expected."""
    frames, scores, mean = globals()[f"with_{library}"](root)
    # Torch's numbers have single precision: 24 bits.
    exact = 0.0 if library != "torch" else 2.0**-23
    assert [int(row["frame_id"]) for row in frames] == expected["frame_id"].tolist()
    for row, pixels, pose in zip(frames, expected["pixels"], expected["poses"], strict=True):
        image = row["image"]
        image = pixels_of(image["bytes"]) if isinstance(image, dict) else np.squeeze(np.asarray(image))
        assert image.dtype == np.uint8
        assert np.array_equal(image, pixels)
        np.testing.assert_allclose([float(row[name]) for name in POSE], pose, rtol=exact, atol=0.0)
    found = [row[ERROR] for row in scores]
    assert None in found
    errors = [error for error in found if error is not None]
    np.testing.assert_allclose(errors, expected["errors"], rtol=exact, atol=0.0)
    # Sums in another order.
    np.testing.assert_allclose(mean, expected["errors"].mean(), rtol=1e-12 + 4.0 * exact)


if __name__ == "__main__":
    check(sys.argv[3], Path(sys.argv[1]), np.load(sys.argv[2]))
    print(f"{sys.argv[3]}: equal")
