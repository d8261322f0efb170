"""Whether poses of a file seem to have another unit, or the other direction, than they are read with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from eposit import Pose, Status
from eposit.arrays import Array
from eposit.pose import rotation_error_rad
from pipelines.adapters.results import PoseResult
from pipelines.stages.pose_formats import PoseFormat

UNITS = {"mm": 1.0, "metres": 1e3, "centimetres": 10.0}  # mm in one unit
DIRECTIONS = ("cam_from_obj", "obj_from_cam")
LEAST_GAIN = 10.0  # times the median error falls: a system that is merely poor has no such reading
PLAUSIBLE = 0.1  # median error of a reading that is worth a word: a tenth of the distance, or 6 degrees


class ConventionErrors:
    """Errors of poses as they are read, and as they would be in other units and inverted."""

    def __init__(self, form: PoseFormat) -> None:
        """No poses yet. form: whose unit and direction they were read with."""
        self._read = (next(unit for unit, mm in UNITS.items() if mm == form.mm), DIRECTIONS[form.is_camera_in_world])
        self._mm = form.mm
        self._errors: list[Array] = []  # of (readings, n)

    def add(self, frames: Sequence[int], true: Pose, answers: Mapping[int, PoseResult]) -> None:
        """Compare poses with the truth. frames: of true, (n, 3, 3) and (n, 3) mm."""
        rows = [i for i, frame in enumerate(frames) if frame in answers and answers[frame].status == Status.OK]
        if not rows:
            return
        given = [answers[frames[i]] for i in rows]
        found = Pose(np.stack([pose.R for pose in given]), np.stack([pose.t for pose in given]))
        truth = Pose(true.R[rows], true.t[rows])
        readings = [Pose(pose.R, pose.t * mm / self._mm) for pose in (found, found.inverse()) for mm in UNITS.values()]
        self._errors.append(np.stack([_errors(reading, truth) for reading in readings]))

    def warning(self, path: Path) -> str | None:
        """A sentence on the file, if another reading of its poses is far nearer to the truth."""
        if not self._errors:
            return None
        medians = np.median(np.concatenate(self._errors, axis=1), axis=1)
        unit, direction = self._read
        as_read, best = list(UNITS).index(unit), int(np.argmin(medians))
        if not (medians[best] < PLAUSIBLE and medians[best] * LEAST_GAIN < medians[as_read]):
            return None
        inverted, place = divmod(best, len(UNITS))
        other = DIRECTIONS[1 - DIRECTIONS.index(direction)]
        meant = [f"positions in {list(UNITS)[place]} instead of {unit}"] if place != as_read else []
        meant += [f"{other} instead of {direction}"] if inverted else []
        return (
            f"{path} seems to hold {' and '.join(meant)}: read so, its median error falls from "
            f"{medians[as_read]:.2g} to {medians[best]:.2g} (position by distance, plus rotation in rad); the poses "
            f"are scored as they are: mend the file and score it again"
        )


def _errors(found: Pose, true: Pose) -> Array:
    """(n,) errors of position by the true distance, plus angles of rotation in rad."""
    distances = np.linalg.norm(true.t, axis=1)
    position = np.linalg.norm(found.t - true.t, axis=1) / np.maximum(distances, np.finfo(float).tiny)
    return position + rotation_error_rad(found.R, true.R)
