"""Columns to tables and back."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from datasets.errors import UserError
from datasets.schema import ESTIMATES
from datasets.store.images import decode_pixels, decode_png
from datasets.store.nulls import with_nans
from eposit import Camera, Pose, Solution, Status
from eposit.arrays import Array, Mask
from eposit.lens import COEFFICIENTS
from render.targets import Target

LEAST_SIDE_PX = 16
QUATERNION_COLUMNS = tuple(f"q_{axis}" for axis in "wxyz")
POSITION_COLUMNS = tuple(f"t_{axis}_mm" for axis in "xyz")


def table(schema: pa.Schema, columns: dict[str, Any]) -> pa.Table:
    """A table of `schema` from a mapping of columns."""
    return pa.table(
        [pa.array(columns[field.name], type=field.type, from_pandas=False) for field in schema], schema=schema
    )


def pose_columns(R: Array, t: Array) -> dict[str, Array]:
    """Quaternion and position columns of (b, 3, 3) and (b, 3); NaN poses give NaN."""
    finite = np.all(np.isfinite(R), axis=(1, 2))
    quaternion = np.full((len(t), 4), np.nan)
    if np.any(finite):
        quaternion[finite] = Pose(R[finite], t[finite]).quaternion
    columns = dict(zip(QUATERNION_COLUMNS, quaternion.T, strict=True))
    return columns | dict(zip(POSITION_COLUMNS, t.T, strict=True))


def estimate_rows(
    frame_ids: Sequence[int], draws: Sequence[int], key: tuple[str, str, str, str], found: Solution, points: int
) -> pa.Table:
    """Rows of `estimates` from b solutions. key: solver, points, camera and use. points: how many the solver had."""
    b = len(frame_ids)
    columns = {
        "frame_id": frame_ids,
        **{
            name: [value] * b
            for name, value in zip(("solver", "point_source", "assumed_camera", "point_set"), key, strict=True)
        },
        "noise_draw": draws,
        "status": found.status,
        "n_points": np.full(b, points),
        **pose_columns(found.cam_from_obj.R, found.cam_from_obj.t),
        "iterations": found.iterations,
        "reprojection_rmse_px": found.reprojection_rmse_px,
        "covariance": list(found.covariance.reshape(b, 36)),
        "ambiguous": _flags(found.ambiguous, found),
        "covariance_unreliable": _flags(found.covariance_unreliable, found),
    }
    return table(ESTIMATES, columns)


def _flags(values: bool | Mask, found: Solution) -> list[bool | None]:
    """(b,) flags of the poses; None for failures, and for a solver that tells none, whose flag is one for all."""
    ok = np.asarray(found.status) == Status.OK
    if np.ndim(values) == 0:
        return [None] * len(ok)
    return [bool(value) if solved else None for value, solved in zip(np.asarray(values), ok, strict=True)]


def numbers(rows: pa.Table, *names: str) -> Array:
    """(n, k) values of k columns of floats; nulls are NaN."""
    return np.stack([with_nans(rows[name]) for name in names], axis=1)


def poses(rows: pa.Table) -> Pose:
    """(b,) poses from quaternion and position columns; rows without a pose are NaN."""
    quaternion = numbers(rows, *(f"q_{axis}" for axis in "wxyz"))
    t = numbers(rows, *(f"t_{axis}_mm" for axis in "xyz"))
    finite = np.all(np.isfinite(quaternion), axis=1)
    R = np.full((len(t), 3, 3), np.nan)
    if np.any(finite):
        R[finite] = Pose.from_quaternion(quaternion[finite], t[finite]).R
    return Pose(R, t)


def pose_covariances(rows: pa.Table) -> Array:
    """(b, 6, 6) of rows of `estimates`, NaN where none is stated."""
    return with_nans(rows["covariance"]).reshape(-1, 6, 6)


def camera_of(row: dict[str, Any]) -> Camera:
    """The true camera of a row of `frames`."""
    names, _ = COEFFICIENTS.get(row["lens"], ((), ""))
    coefficients = tuple(row[f"k{i}"] for i in range(1, 1 + len(names)))
    return Camera(
        lens=row["lens"],
        **{name: row[f"{name}_px"] for name in ("fx", "fy", "cx", "cy", "width", "height")},
        coefficients=coefficients,
    )


def decode_image(image: dict[str, Any], path: Path, frame_id: int, *, in_colour: bool = False) -> NDArray[np.uint8]:
    """(height, width) grey values of an image of `frames`, of one in colour too; in_colour: its RGB, if it has any.

    Raises:
        UserError: not an 8-bit PNG, or too small to hold a board; the message names the shard.
    """
    try:
        pixels = (decode_pixels if in_colour else decode_png)(image["bytes"])
        if min(pixels.shape[:2]) < LEAST_SIDE_PX:
            raise ValueError(f"the image is {pixels.shape[1]} x {pixels.shape[0]} px")
    except ValueError as error:
        raise UserError(f"{path}, frame {frame_id}: {error}; delete it and run the generate stage again") from None
    return pixels


def of_detector(detections: pa.Table, detector: str) -> pa.Table:
    """The rows of one detector."""
    return detections.filter(pa.array(detections["detector"].to_numpy(zero_copy_only=False) == detector))


def covariances_by_frame(rows: pa.Table, target: Target) -> dict[int, Array]:
    """frame_id to (n, 2, 2) px^2 from rows of `detections`; NaN where a point was not found."""
    count = len(target.points)
    found = numbers(rows, "var_x_px2", "cov_xy_px2", "cov_xy_px2", "var_y_px2").reshape(-1, count, 2, 2)
    frame = rows["frame_id"].to_numpy()
    return {int(frame[i * count]): found[i] for i in range(len(found))}


def joint_factors_by_frame(rows: pa.Table, target: Target) -> dict[int, Array]:
    """frame_id to (n, 2, k) px from rows of `detections`, where a frame has factors; NaN where a point has none."""
    count, lists = len(target.points), rows["joint_factor_px"].combine_chunks()
    if lists.null_count == len(lists):
        return {}
    frame = rows["frame_id"].to_numpy()
    found: dict[int, Array] = {}
    for start in range(0, len(lists), count):
        part = lists.slice(start, count)
        there = part.is_valid().to_numpy(zero_copy_only=False)
        if np.any(there):
            values = with_nans(part.drop_null().flatten()).reshape(int(np.sum(there)), 2, -1)
            found[int(frame[start])] = np.full((count, *values.shape[1:]), np.nan)
            found[int(frame[start])][there] = values
    return found


def points_by_frame(rows: pa.Table, target: Target) -> dict[int, Array]:
    """frame_id to (n, 2) px from a long table of points; NaN where there is none."""
    count = len(target.points)
    frame = rows["frame_id"].to_numpy()
    pixels = numbers(rows, "x_px", "y_px").reshape(-1, count, 2)
    return {int(frame[i * count]): pixels[i] for i in range(len(pixels))}
