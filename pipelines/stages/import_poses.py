"""A file of poses that another system made, CSV or Parquet, as rows of `estimates`."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from datasets.errors import UserError
from datasets.plan import shard_count
from datasets.rows import POSITION_COLUMNS, QUATERNION_COLUMNS, poses
from datasets.store.dataset import Dataset
from datasets.store.digest import table_digest
from eposit import Pose, Status
from eposit.arrays import Array
from eposit.pose import rotation_from_vector
from pipelines.adapters.registry import solver_names
from pipelines.adapters.results import MOST_LETTERS, PoseResult, pose_result
from pipelines.stages import score
from pipelines.stages.estimate import path_of_shard
from pipelines.stages.estimate_images import system_rows
from pipelines.stages.pose_conventions import ConventionErrors
from pipelines.stages.pose_formats import FORMATS, TABLE, PoseFormat
from pipelines.stages.pose_tables import FRAME, MATRIX, POSITIONS, VECTOR, columns_of
from pipelines.stages.settings import System

FORM = (
    "frame_id, q_w q_x q_y q_z or r11 to r33, and t_x_mm t_y_mm t_z_mm or tx ty tz in mm, or rvec and tvec; "
    "--pose-format reads other programs' files"
)
NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,63}")
TOLERANCE = 1e-3  # of a quaternion's length and of R^T R - 1: three decimals


@dataclass(frozen=True, slots=True)
class Imported:
    """What is to be told of a file of poses that was taken as it is."""

    missing: int  # frames that the file has no pose for: their status is missing
    warning: str | None  # names the unit or the direction that the poses seem to have instead of ours


def import_poses(dataset: Dataset, path: Path, system: System, pose_format: str = TABLE) -> Imported:
    """Write a file's poses as the estimates of a system, and forget its old scores where they differ.

    pose_format: of `FORMATS`.
    Raises:
        UserError: an unknown format, a name that is not usable, a file that cannot be read, or poses that are wrong.
    """
    known = dataset.read("frames", [FRAME])[FRAME].to_pylist()
    answers = poses_of(path, system, known, str(dataset.root), pose_format)
    count, conventions = shard_count(dataset.recipe), ConventionErrors(FORMATS[pose_format])
    for index in range(count):
        frames = dataset.read_shard(
            dataset.shard_path("frames", index, count), [FRAME, *QUATERNION_COLUMNS, *POSITION_COLUMNS]
        )
        ids = frames[FRAME].to_pylist()
        conventions.add(ids, poses(frames), answers)
        rows = system_rows(ids, system, [answers.get(frame, PoseResult(Status.MISSING)) for frame in ids])
        shard = path_of_shard(dataset, index, system.shard_name)
        if not (dataset.is_done(shard) and table_digest(dataset.read_shard(shard)) == table_digest(rows)):
            score.forget(dataset, shard)
            dataset.write_shard(shard, rows)
    dataset.write_manifest()
    return Imported(len(set(known) - set(answers)), conventions.warning(path))


def poses_of(
    path: Path, system: System, known: Collection[int], where: str, pose_format: str = TABLE
) -> dict[int, PoseResult]:
    """frame_id to pose of a file for a dataset with some frames. where: names the dataset.

    Raises:
        UserError: a name that is not usable, a file that cannot be read, poses that are wrong, or an unknown frame.
    """
    _check_name(system.name)
    answers = read_poses(path, pose_format)
    unknown = sorted(set(answers).difference(known))
    if unknown:
        more = f" and {len(unknown) - 1} more" if len(unknown) > 1 else ""
        raise UserError(
            f"{path} has frame_id {unknown[0]}{more}, which {where} has not; its frames are {min(known)} to "
            f"{max(known)}"
        )
    return answers


def _check_name(name: str) -> None:
    if not NAME.fullmatch(name):
        raise UserError(f"name {name!r} is not usable; give --name of letters, digits, '.', '_' and '-', at most 64")
    if name in solver_names():
        raise UserError(f"name {name!r} is a solver's; give --name another one")


def read_poses(path: Path, pose_format: str = TABLE) -> dict[int, PoseResult]:
    """frame_id to pose. A row is a failure if its `status` says another thing than ok, or its whole pose is empty.

    Raises:
        UserError: a format that is not known, or what is wrong with the file, its columns or its first wrong row.
    """
    if pose_format not in FORMATS:
        raise UserError(f"unknown --pose-format {pose_format!r}; give one of {', '.join(FORMATS)}")
    form = FORMATS[pose_format]
    columns = columns_of(path, form.read)
    rotation = _chosen(path, columns, (QUATERNION_COLUMNS, MATRIX, VECTOR))
    position = _chosen(path, columns, POSITIONS)
    numbers = {name: _numbers(path, name, columns[name]) for name in (FRAME, *rotation, *position)}
    frames = _frames(path, numbers[FRAME])
    R = np.stack([numbers[name] for name in rotation], axis=1)
    t = np.stack([numbers[name] for name in position], axis=1)
    statuses = [str(status or "").strip() or Status.OK for status in columns.get("status", [None] * len(frames))]
    with np.errstate(over="ignore"):  # numbers near the largest float: their squares are refused as infinite
        return {
            frame: (
                _cam_from_obj(form, _pose(path, frame, R[i], t[i]))
                if status.lower() == Status.OK
                else PoseResult(status[:MOST_LETTERS])
            )
            for i, (frame, status) in enumerate(zip(frames, statuses, strict=True))
        }


def _chosen(path: Path, columns: dict[str, list[Any]], choices: tuple[tuple[str, ...], ...]) -> tuple[str, ...]:
    """The one choice whose columns are there."""
    there = [names for names in choices if all(name in columns for name in names)]
    if len(there) == 1 and FRAME in columns:
        return there[0]
    if len(there) > 1:
        raise UserError(f"{path} has columns {there[0][0]} and {there[1][0]}, two forms of the same; leave one out")
    shown = ", ".join(list(columns)[:20]) or "none"
    raise UserError(f"{path} has the columns {shown}; a file of poses needs {FORM}")


def _numbers(path: Path, name: str, values: list[Any]) -> Array:
    """Values as floats; None and empty text are NaN."""
    numbers = np.full(len(values), np.nan)
    for i, value in enumerate(values):
        if value is None or (isinstance(value, str) and not value.strip()):
            continue
        try:
            numbers[i] = float(value)
        except (TypeError, ValueError):
            raise UserError(f"{path}, row {i + 1}: {name} is {value!r}, which is not a number; mend it") from None
    return numbers


def _frames(path: Path, numbers: Array) -> list[int]:
    if not len(numbers):
        raise UserError(f"{path} holds no poses; give --poses a file with a row for each image")
    wrong = np.flatnonzero(~(np.isfinite(numbers) & (numbers == np.round(numbers))))
    if len(wrong):
        raise UserError(f"{path}, row {wrong[0] + 1}: frame_id is {numbers[wrong[0]]:g}; it must be a whole number")
    frames = [int(number) for number in numbers]
    values, counts = np.unique(frames, return_counts=True)
    if np.any(counts > 1):
        raise UserError(f"{path} has frame_id {values[counts > 1][0]} more than once; give one pose for each frame")
    return frames


def _pose(path: Path, frame: int, rotation: Array, t: Array) -> PoseResult:
    """One row's pose. rotation: (4,) quaternion, (9,) matrix row by row, or (3,) rotation vector in rad."""
    if np.all(np.isnan(rotation)) and np.all(np.isnan(t)):
        return PoseResult(Status.NO_SOLUTION)
    where = f"{path}, frame_id {frame}"
    if not (np.all(np.isfinite(rotation)) and np.all(np.isfinite(t))):
        raise UserError(f"{where}: the pose has values that are not finite; a failure leaves all of them empty")
    if len(rotation) == len(QUATERNION_COLUMNS):
        length = float(np.linalg.norm(rotation))
        if abs(length - 1.0) > TOLERANCE:
            raise UserError(f"{where}: the quaternion has length {length:.6g}; it must be 1 to within {TOLERANCE:g}")
        return pose_result(Pose.from_quaternion(rotation, t).R, t)
    if len(rotation) == len(VECTOR):
        return pose_result(rotation_from_vector(rotation), t)
    R = rotation.reshape(3, 3)
    off = float(np.abs(R.T @ R - np.eye(3)).max())
    if off > TOLERANCE or np.linalg.det(R) < 0.0:
        fault = f"R^T R is off by {off:.3g}" if off > TOLERANCE else "it mirrors"
        raise UserError(f"{where}: r11 to r33 are no rotation: {fault}; write it row by row, to within {TOLERANCE:g}")
    return pose_result(R, t)


def _cam_from_obj(form: PoseFormat, given: PoseResult) -> PoseResult:
    """A pose of another format in ours: cam_from_obj, mm."""
    if given.status != Status.OK:
        return given
    pose = Pose(given.R, given.t * form.mm)
    pose = pose.inverse() if form.is_camera_in_world else pose
    return pose_result(pose.R, pose.t)
