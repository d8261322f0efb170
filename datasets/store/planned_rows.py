"""What the plan says of each row of `frames` and `keypoints`, held against a shard: wrong truth is found.

Numbers may differ by rounding, as a shard may come from a machine with other mathematical libraries.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pyarrow as pa

from datasets.plan import Frame, frames_of_shard
from datasets.recipe.model import Recipe
from datasets.store.images import NO_PNG, decode_pixels, png_size
from datasets.store.nulls import with_nans
from eposit.arrays import Array
from eposit.calibrated_lens import MOST_COEFFICIENTS
from render.motion import image_points

TOLERANCE = 1e-6  # relative, and absolute below 1: far above rounding, far below any error that is looked for
SAME = ("frame_id", "pose_id", "render_seed", "sensor_seed")  # columns that are a frame's own values
OF_CAMERA = {"camera_name": "name", "lens": "lens", "width_px": "width", "height_px": "height"}
QUATERNION, POSITION = ("q_w", "q_x", "q_y", "q_z"), ("t_x_mm", "t_y_mm", "t_z_mm")
REGION = ("region_x_px", "region_y_px", "region_width_px", "region_height_px")
OF_LENS = {"fx_px": "fx", "fy_px": "fy", "cx_px": "cx", "cy_px": "cy"}


def fault_of_truth(recipe: Recipe, table: str, index: int, rows: pa.Table) -> str | None:
    """What in a shard of `frames` or `keypoints`, all columns or some, is not as planned; None if nothing.

    Of pictures the size that their headers claim is compared; other tables have no truth.
    """
    if table == "frames":
        return _fault_of_frames(recipe, index, rows)
    return _fault_of_keypoints(recipe, index, rows) if table == "keypoints" else None


def _fault_of_frames(recipe: Recipe, index: int, rows: pa.Table) -> str | None:
    frames = frames_of_shard(recipe, index)
    exact = {name: [getattr(frame, name) for frame in frames] for name in SAME}
    exact |= {column: [getattr(frame.camera, name) for frame in frames] for column, name in OF_CAMERA.items()}
    close = {column: np.array([getattr(frame.camera, name) for frame in frames]) for column, name in OF_LENS.items()}
    close["time_s"] = np.array([frame.time_s for frame in frames])
    close |= dict(zip(POSITION, np.array([frame.cam_from_obj.t for frame in frames]).T, strict=True))
    close |= dict(zip(QUATERNION, np.array([frame.cam_from_obj.quaternion for frame in frames]).T, strict=True))
    close["nominal_f_px"] = np.array([frame.camera.nominal_camera().fx for frame in frames])
    coefficients = [(*frame.camera.coefficients, *[0.0] * MOST_COEFFICIENTS)[:MOST_COEFFICIENTS] for frame in frames]
    close |= dict(zip((f"k{i}" for i in range(1, 1 + MOST_COEFFICIENTS)), np.array(coefficients).T, strict=True))
    wrong = [name for name, values in exact.items() if name in rows.column_names and rows[name].to_pylist() != values]
    told = _told([*wrong, *_far(rows, close)]) or _fault_of_regions(frames, rows)
    return told or (_fault_of_sizes(frames, rows) if "image" in rows.column_names else None)


def _fault_of_regions(frames: Sequence[Frame], rows: pa.Table) -> str | None:
    if any(name not in rows.column_names for name in REGION):
        return None
    x, y, width, height = (rows[name].to_numpy().astype(np.int64) for name in REGION)
    right, bottom = (np.array([getattr(frame.camera, name) for frame in frames]) for name in ("width", "height"))
    inside = (x >= 0) & (y >= 0) & (width > 0) & (height > 0) & (x + width <= right) & (y + height <= bottom)
    return None if np.all(inside) else "its region lies outside the picture"


def _fault_of_sizes(frames: Sequence[Frame], rows: pa.Table) -> str | None:
    for frame, image in zip(frames, rows["image"].to_pylist(), strict=True):
        size = png_size(image["bytes"])
        if size is None:
            return f"frame {frame.frame_id}: {NO_PNG}"
        if size != (frame.camera.height, frame.camera.width):
            return f"frame {frame.frame_id}: its picture is of {size[1]} x {size[0]} pixels"
    return None


def _fault_of_keypoints(recipe: Recipe, index: int, rows: pa.Table) -> str | None:
    frames, points = frames_of_shard(recipe, index), recipe.target.points
    images = np.concatenate([image_points(frame.camera.true_camera(), frame.cam_from_obj, points) for frame in frames])
    wanted = {"x_px": images[:, 0], "y_px": images[:, 1]}
    wanted |= {f"{axis}_obj_mm": np.tile(points[:, i], len(frames)) for i, axis in enumerate("xyz")}
    return _told([*_far(rows, wanted)])


def _far(rows: pa.Table, wanted: Mapping[str, Array]) -> Iterator[str]:
    """Columns that are there and are not as wanted."""
    return (
        name
        for name, values in wanted.items()
        if name in rows.column_names and not _is_close(with_nans(rows[name]), values)
    )


def _told(wrong: Sequence[str]) -> str | None:
    return f"its {wrong[0]} is not what the recipe plans" if wrong else None


def fault_of_images(recipe: Recipe, index: int, rows: pa.Table) -> str | None:
    """Which picture of a shard of `frames` cannot be decoded or is not of its camera's size; None if none."""
    frames = frames_of_shard(recipe, index)
    for frame, image in zip(frames, rows["image"].to_pylist(), strict=True):
        try:
            shape = decode_pixels(image["bytes"]).shape
        except (ValueError, TypeError) as error:
            return f"frame {frame.frame_id}: {error}"
        size = frame.camera.height, frame.camera.width
        if shape != ((*size, 3) if recipe.outputs.colour else size):
            return f"frame {frame.frame_id}: its picture is of {shape[1]} x {shape[0]} pixels or of other channels"
    return None


def _is_close(found: Array, wanted: Array) -> bool:
    return bool(np.allclose(found, wanted, rtol=TOLERANCE, atol=TOLERANCE, equal_nan=True))
