"""Files of poses in the forms of other programs, as columns of a table of poses.

Definitions: KITTI odometry's development kit (readme.txt), TUM's RGB-D benchmark (file formats), COLMAP's output format
(images.txt), the BOP challenge's format of results, and the ground truth of EuRoC MAV (ASL format).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from datasets.errors import UserError
from datasets.rows import QUATERNION_COLUMNS
from pipelines.stages.pose_tables import FRAME, MATRIX, POSITIONS, NamesAndColumns, Reader, check_rows, read_csv

TABLE = "table"
XYZ = POSITIONS[1]
XYZW = (*QUATERNION_COLUMNS[1:], QUATERNION_COLUMNS[0])
MOST_FRAMES = 2**53  # whole numbers above are not all floats; times in ns are above
COLMAP_VALUES = 10  # of an image's first line: number, quaternion, position, camera, name


@dataclass(frozen=True, slots=True)
class PoseFormat:
    """How a kind of file is read, and what its numbers mean."""

    read: Reader | None = None  # None: by the file's suffix
    mm: float = 1.0  # in its unit of length
    is_camera_in_world: bool = False  # obj_from_cam, with the target's frame as the world; else cam_from_obj


def _read_kitti(path: Path) -> NamesAndColumns:
    """[R | t] row by row, 12 numbers a line; the line's number, from 0, is the frame_id."""
    names = [name for row in range(3) for name in (*MATRIX[3 * row : 3 * row + 3], XYZ[row])]
    rows = _rows(path, "KITTI", len(names))
    return _columns([FRAME, *names], [[str(i), *row] for i, row in enumerate(rows)])


def _read_tum(path: Path) -> NamesAndColumns:
    """Timestamp tx ty tz qx qy qz qw; the timestamp is the frame_id."""
    names = [FRAME, *XYZ, *XYZW]
    return _columns(names, _numbered(path, _rows(path, "TUM", len(names))))


def _read_euroc(path: Path) -> NamesAndColumns:
    """Timestamp, x y z, q_w q_x q_y q_z, and more that is not read; the timestamp is the frame_id."""
    names = [FRAME, *XYZ, *QUATERNION_COLUMNS]
    return _columns(names, _numbered(path, _rows(path, "EuRoC", len(names), more=True)))


def _read_bop(path: Path) -> NamesAndColumns:
    """scene_id,im_id,obj_id,score,R,t,time with 9 and 3 numbers apart by spaces; im_id is the frame_id."""
    header, columns = read_csv(path)
    table = dict(zip(header, columns, strict=True))
    missing = next((name for name in ("im_id", "R", "t") if name not in table), None)
    if missing is not None:
        raise UserError(f"{path} has no column {missing}; BOP has scene_id,im_id,obj_id,score,R,t,time")
    rows = []
    for i, (frame, R, t) in enumerate(zip(table["im_id"], table["R"], table["t"], strict=True), 1):
        numbers = [*R.split(), *t.split()]
        if (len(R.split()), len(t.split())) != (len(MATRIX), len(XYZ)):
            raise UserError(
                f"{path}, row {i} has {len(R.split())} values in R and {len(t.split())} in t; BOP has 9 and 3"
            )
        rows.append([frame, *numbers])
    return _columns([FRAME, *MATRIX, *XYZ], rows)


def _read_colmap(path: Path) -> NamesAndColumns:
    """Two lines an image; the last whole number in the image's name is the frame_id."""
    rows = []
    with open(path, encoding="utf-8-sig") as file:
        for line, text in _colmap_images(path, file):
            values = text.split(maxsplit=COLMAP_VALUES - 1)
            numbers = re.findall(r"\d+", Path(values[-1]).stem) if len(values) == COLMAP_VALUES else []
            if not numbers:
                raise UserError(
                    f"{path}, line {line} is no image's line of COLMAP's images.txt, IMAGE_ID QW QX QY QZ TX TY TZ "
                    f"CAMERA_ID NAME with the frame_id in the name; a line of points, which may be empty, follows each"
                )
            rows.append([numbers[-1], *values[1:8]])
            check_rows(path, len(rows))
    return _columns([FRAME, *QUATERNION_COLUMNS, *XYZ], rows)


def _colmap_images(path: Path, file: TextIO) -> Iterator[tuple[int, str]]:
    """Number and text of each image's first line; its second one, of points, may be empty."""
    lines = enumerate(file, 1)
    for line, text in lines:
        if text.strip() and not text.startswith("#"):
            yield line, text
            second, points = next(lines, (0, ""))
            if len(points.split()) % 3:
                raise UserError(f"{path}, line {second} is no line of points (X, Y, POINT3D_ID), which may be empty")


def _rows(path: Path, name: str, count: int, *, more: bool = False) -> list[list[str]]:
    """Values of each line, apart by blanks or commas, without comments (#), empty lines and a first line of names.

    more: lines may have more values than count, which are left out.
    """
    rows: list[list[str]] = []
    with open(path, encoding="utf-8-sig") as file:
        for line, text in enumerate(file, 1):
            values = text.replace(",", " ").split()
            if not values or text.lstrip().startswith("#") or (not rows and not any(map(_is_number, values))):
                continue
            if len(values) < count or (len(values) > count and not more):
                raise UserError(f"{path}, line {line} has {len(values)} values; {name} has {count}")
            rows.append(values[:count])
            check_rows(path, len(rows))
    return rows


def _numbered(path: Path, rows: list[list[str]]) -> list[list[str]]:
    """Rows whose first value is a frame_id, not a time."""
    for values in rows:
        if not (_is_number(values[0]) and float(values[0]).is_integer() and abs(float(values[0])) < MOST_FRAMES):
            raise UserError(f"{path} has the timestamp {values[0]}; write each image's frame_id in its place")
    return rows


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _columns(names: list[str], rows: list[list[str]]) -> NamesAndColumns:
    return names, [[row[i] for row in rows] for i in range(len(names))]


FORMATS = {
    TABLE: PoseFormat(),
    "kitti": PoseFormat(_read_kitti, 1e3, is_camera_in_world=True),
    "tum": PoseFormat(_read_tum, 1e3, is_camera_in_world=True),
    "colmap": PoseFormat(_read_colmap),  # a reconstruction has no unit of its own: it is read as mm
    "bop": PoseFormat(_read_bop),
    "euroc": PoseFormat(_read_euroc, 1e3, is_camera_in_world=True),
}
