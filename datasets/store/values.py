"""What no shard's values can be, whoever wrote its digests: a reader may rely on the rest without looking again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from datasets.schema import FRAME_ID, LATER_COLUMNS, TABLES
from datasets.store.nulls import is_list_of_floats, is_ragged_list_of_floats, with_nans
from datasets.store.texts import longest

MOST = 1e75  # of any number's size: fourth powers stay finite
MOST_LETTERS = 1000  # of a text
OPTIONAL = LATER_COLUMNS | {"master", "failure_reason"}  # texts, whole numbers and flags that may be null
OK = "ok"
# Where the status is ok these have values: a null would be left out of averages in silence.
OF_OK = {
    "detections": ("x_px", "y_px"),
    "estimates": ("q_w", "q_x", "q_y", "q_z", "t_x_mm", "t_y_mm", "t_z_mm"),
    "scores": ("rotation_error_deg", "tx_error_mm", "ty_error_mm", "tz_error_mm"),
}
QUATERNION = ("q_w", "q_x", "q_y", "q_z")
UNIT_TOLERANCE = 1e-6  # of a quaternion's length


def fault_of_values(table: str, rows: pa.Table) -> str | None:
    """What in the rows of a table, all columns or some, cannot be; None if nothing."""
    return next(_faults(table, rows), None)


def _faults(table: str, rows: pa.Table) -> Iterator[str]:
    for name in rows.column_names:
        kind, column = rows.schema.field(name).type, rows.column(name)
        if pa.types.is_floating(kind) or is_list_of_floats(kind):
            if np.any(np.abs(with_nans(column)) > MOST):
                yield f"its {name} has a number beyond {MOST:g}"
        elif is_ragged_list_of_floats(kind):
            if not np.all(np.abs(with_nans(column.combine_chunks().flatten())) <= MOST):
                yield f"its {name} has what is no number, or one beyond {MOST:g}"
        elif column.null_count and name in TABLES[table].names and name not in OPTIONAL:
            yield f"its {name} has a row without a value"
        elif pa.types.is_string(kind) and longest(column, "utf8_length") > MOST_LETTERS:
            yield f"its {name} has a text of more than {MOST_LETTERS} letters"
    yield from _faults_of_images(rows)
    yield from _faults_of_factors(rows)
    if "status" in rows.column_names:
        yield from _faults_of_status(table, rows)
    if all(name in rows.column_names for name in QUATERNION):
        lengths = np.linalg.norm([with_nans(rows[name]) for name in QUATERNION], axis=0)
        if np.any(np.abs(lengths - 1.0) > UNIT_TOLERANCE):
            yield "it has a quaternion whose length is not 1"


def _faults_of_images(rows: pa.Table) -> Iterator[str]:
    if "image" in rows.column_names:
        data = rows["image"].combine_chunks().field("bytes")
        if data.null_count:
            yield "it has a row without a picture"


def _faults_of_factors(rows: pa.Table) -> Iterator[str]:
    """The factors of a frame's points are matrices of two rows, as wide as each other."""
    if "joint_factor_px" not in rows.column_names or FRAME_ID not in rows.column_names:
        return
    lengths = with_nans(pc.call_function("list_value_length", [rows["joint_factor_px"]]))
    there = np.isfinite(lengths)
    lengths, frames = lengths[there], rows[FRAME_ID].to_numpy()[there]
    if np.any(lengths % 2) or np.any(lengths == 0) or np.any((np.diff(lengths) != 0) & (np.diff(frames) == 0)):
        yield "its joint_factor_px are not matrices of two rows, as wide as each other in a frame"


def _faults_of_status(table: str, rows: pa.Table) -> Iterator[str]:
    solved = rows["status"].to_numpy() == OK
    for name in OF_OK.get(table, ()):
        if name in rows.column_names and np.any(np.isnan(with_nans(rows[name])[solved])):
            yield f"it has a row whose status is ok and whose {name} has no value"
