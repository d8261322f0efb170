"""The picture of the README from the demo's dataset: frames in the room above, frames of the closed form below.

Usage: python -m tools.frames_picture out/demo docs/frames.png, after `make demo`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from datasets.rows import decode_image
from datasets.store.dataset import Dataset, open_dataset
from eposit.arrays import Array
from pipelines.commands.stages import ROOM
from pipelines.detection import Detector
from pipelines.pages.frames import Crop, crops, marks_by_frame

WIDTH, GAP = 1050, 8  # px
ABOVE = ("perspective", "equisolid", "orthogonal")  # cameras whose first frame in the room is shown
BELOW = (("perspective", 0), ("orthogonal", 0), ("orthogonal", 7))  # camera and pose of the closed form
POINT_SHARE, FIRST, OTHER, CIRCLE = 0.012, (34, 139, 34), (31, 100, 200), (230, 90, 20)  # of a picture's width; RGB

Image = NDArray[np.uint8]  # (h, w, 3) RGB


def main(demo: Path, out: Path) -> None:
    """Write the picture of the dataset in `demo`."""
    closed, room = open_dataset(demo), open_dataset(demo / ROOM)
    rows = [_in_one_row(whole_pictures(room)), _in_one_row(boards(closed))]
    gap = np.full((GAP, WIDTH, 3), 255, np.uint8)
    picture = np.concatenate([rows[0], gap, rows[1]])
    _, data = cv2.imencode(".png", cv2.cvtColor(picture, cv2.COLOR_RGB2BGR), [cv2.IMWRITE_PNG_COMPRESSION, 9])
    out.write_bytes(data.tobytes())


def whole_pictures(dataset: Dataset) -> list[Image]:
    """The first frame of each camera of `ABOVE`."""
    frames = dataset.read("frames", ["frame_id", "camera_name", "pose_id", "image"]).to_pylist()
    first = {frame["camera_name"]: frame for frame in frames if frame["pose_id"] == 0}
    return [decode_image(first[name]["image"], dataset.root, first[name]["frame_id"], in_colour=True) for name in ABOVE]


def boards(dataset: Dataset) -> list[Image]:
    """The boards of the frames of `BELOW` with the points that were found in them."""
    frames = dataset.read("frames", ["frame_id", "camera_name", "pose_id"]).to_pylist()
    number = {(frame["camera_name"], frame["pose_id"]): frame["frame_id"] for frame in frames}
    chosen = [number[one] for one in BELOW]
    shown, marks = crops(dataset, set(chosen)), marks_by_frame(dataset, Detector.EDGE_FIT)
    return [_marked(shown[frame], marks[frame].points_px) for frame in chosen]


def _marked(crop: Crop, points: Array) -> Image:
    image = np.repeat(crop.image[..., None], 3, axis=2) if crop.image.ndim == 2 else crop.image.copy()
    radius = round(POINT_SHARE * max(image.shape))
    for i, (x, y) in enumerate(points - crop.corner):
        colour = FIRST if i == 0 else CIRCLE if i == len(points) - 1 else OTHER
        if np.isfinite(x):
            cv2.circle(image, (round(float(x)), round(float(y))), radius, colour, max(1, radius // 4), cv2.LINE_AA)
    return image


def _in_one_row(images: list[Image]) -> Image:
    """Images of one height beside one another, WIDTH px wide in all."""
    ratios = [image.shape[1] / image.shape[0] for image in images]
    height = round((WIDTH - GAP * (len(images) - 1)) / sum(ratios))
    widths = [round(height * ratio) for ratio in ratios[:-1]]
    widths.append(WIDTH - GAP * (len(images) - 1) - sum(widths))
    gap = np.full((height, GAP, 3), 255, np.uint8)
    parts: list[Image] = []
    for image, width in zip(images, widths, strict=True):
        parts += [cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA).astype(np.uint8), gap]
    return np.concatenate(parts[:-1], axis=1)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
