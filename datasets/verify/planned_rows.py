"""What the plan says of each row of `frames` and `keypoints`, held against a shard: wrong truth is found.

Numbers may differ by rounding, as a shard may come from a machine with other mathematical libraries.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa

from datasets.plan import Frame, frames_of_shard
from datasets.recipe.model import Recipe
from datasets.rows import POSITION_COLUMNS, QUATERNION_COLUMNS, numbers
from datasets.store.images import decode_pixels
from eposit.arrays import Array

TOLERANCE = 1e-6  # relative, and absolute below 1: far above rounding, far below any error that is looked for
SAME = ("frame_id", "pose_id", "render_seed", "sensor_seed")  # columns that are a frame's own values
OF_CAMERA = {"camera_name": "name", "lens": "lens", "width_px": "width", "height_px": "height"}
OF_LENS = {"fx_px": "fx", "fy_px": "fy", "cx_px": "cx", "cy_px": "cy"}


def fault_of_frames(recipe: Recipe, index: int, rows: pa.Table) -> str | None:
    """What in a shard of `frames` is not as planned; None if nothing."""
    frames = frames_of_shard(recipe, index)
    exact = {name: [getattr(frame, name) for frame in frames] for name in SAME}
    exact |= {column: [getattr(frame.camera, name) for frame in frames] for column, name in OF_CAMERA.items()}
    close = {column: np.array([getattr(frame.camera, name) for frame in frames]) for column, name in OF_LENS.items()}
    close["time_s"] = np.array([frame.time_s for frame in frames])
    close |= dict(zip(POSITION_COLUMNS, np.array([frame.cam_from_obj.t for frame in frames]).T, strict=True))
    close |= dict(zip(QUATERNION_COLUMNS, np.array([frame.cam_from_obj.quaternion for frame in frames]).T, strict=True))
    wrong = [name for name, values in exact.items() if rows[name].to_pylist() != values]
    wrong += [name for name, values in close.items() if not _is_close(numbers(rows, name)[:, 0], values)]
    if wrong:
        return f"its {wrong[0]} is not what the recipe plans"
    return _fault_of_images(recipe, frames, rows)


def fault_of_keypoints(recipe: Recipe, index: int, rows: pa.Table) -> str | None:
    """What in a shard of `keypoints` is not as planned; None if nothing."""
    frames, points = frames_of_shard(recipe, index), recipe.target.points
    images = np.concatenate([frame.camera.true_camera().project(frame.cam_from_obj.apply(points)) for frame in frames])
    wanted = {"x_px": images[:, 0], "y_px": images[:, 1]}
    wanted |= {f"{axis}_obj_mm": np.tile(points[:, i], len(frames)) for i, axis in enumerate("xyz")}
    wrong = [name for name, values in wanted.items() if not _is_close(numbers(rows, name)[:, 0], values)]
    return f"its {wrong[0]} is not what the recipe plans" if wrong else None


def _fault_of_images(recipe: Recipe, frames: Sequence[Frame], rows: pa.Table) -> str | None:
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
