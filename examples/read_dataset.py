"""A dataset's tables and pictures with pyarrow alone: python examples/read_dataset.py out/demo."""

import json
import sys
from importlib.util import find_spec
from pathlib import Path

import pyarrow.compute as pc
import pyarrow.parquet as pq

root = Path(sys.argv[1] if len(sys.argv) > 1 else "out/demo")

frames = pq.read_table(root / "frames", columns=["frame_id", "camera_name", "lens", "tilt_deg", "image"])
print(f"{frames.num_rows} pictures; the first is {len(frames['image'][0]['bytes'].as_py())} bytes of PNG")

scores = pq.read_table(root / "scores")
print("a column's meaning:", json.loads(scores.schema.metadata[b"meanings"])["gross_failure"])
good = scores.filter(pc.field("status") == "ok").join(frames.drop_columns("image"), "frame_id")
for row in good.group_by(["solver", "lens"]).aggregate([("t_error_relative", "mean")]).to_pylist():
    print(f"{row['solver']:>12} {row['lens']:<14} mean error {row['t_error_relative_mean']:.1e} of the distance")

if find_spec("pandas"):
    table = good.to_pandas()
    print(table.groupby("solver")[["rotation_error_deg", "tz_error_mm"]].median())
