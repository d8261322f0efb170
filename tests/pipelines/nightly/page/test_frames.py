"""Frames of two datasets become pictures: the crop is the image's, the errors are found minus true."""

import numpy as np
import pyarrow as pa
import pytest

from datasets.rows import decode_image
from datasets.store.dataset import open_dataset
from pipelines.nightly.page.frames import Wanted, pictures_of
from pipelines.pages.pictures import drawn


def test_pictures_of_a_dataset(root):
    dataset = open_dataset(root)
    wanted = [Wanted("pinned, own/pinhole/edge-fit", frame_id, "the worst", "look") for frame_id in (1, 0)]
    found = pictures_of(dataset, dataset, wanted)
    assert [item.frame_id for item in found] == [1, 0]
    row = pa.concat_tables([dataset.read_shard(path) for path in dataset.shards("frames")]).to_pylist()[1]
    image = decode_image(row["image"], root, 1)
    x, y = found[0].corner
    height, width = found[0].sides[0].image.shape
    np.testing.assert_array_equal(found[0].sides[0].image, image[y : y + height, x : x + width])
    keypoints, detections = (dataset.read(name).to_pylist() for name in ("keypoints", "detections"))
    seen = [item for item in detections if item["frame_id"] == 1 and item["detector"] == "edge-fit"]
    true = [item for item in keypoints if item["frame_id"] == 1]
    error = [[one["x_px"] - other["x_px"], one["y_px"] - other["y_px"]] for one, other in zip(seen, true, strict=True)]
    np.testing.assert_array_equal(found[0].sides[1].marks.residuals_px, error)
    assert drawn(found[0]).sides[0].told.startswith(f"{len(seen)} of {len(seen)} points, RMS 0.0")


def test_a_frame_that_is_not_there(root):
    dataset = open_dataset(root)
    with pytest.raises(KeyError):
        pictures_of(dataset, dataset, [Wanted("pinned", 9, "", "")])
