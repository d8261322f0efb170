"""A run that has been scored, and means over its poses, which are its independent samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.recipe.model import Recipe
from eposit.arrays import Array, Mask
from pipelines.report.data import Series, frame_means
from pipelines.report.frame_points import FramePoints


@dataclass(frozen=True, slots=True)
class Run:
    """What sentences about a run are made from."""

    recipe: Recipe
    frames: list[dict[str, Any]]  # rows of `frames`
    points: list[FramePoints]  # one a detector, none if nothing was detected
    found: list[Series]

    @property
    def cameras(self) -> NDArray[np.str_]:
        """(f,) each frame's camera."""
        return np.array([frame["camera_name"] for frame in self.frames])

    def poses(self, own: Mask) -> NDArray[np.int64]:
        """Pose of each of some frames; frames of one pose differ by camera only, and are no independent samples."""
        return np.array([frame["pose_id"] for frame in self.frames])[own]


def poses_of(run: Run, item: Series) -> NDArray[np.int64]:
    """(n,) pose of each row."""
    by_frame = {frame["frame_id"]: frame["pose_id"] for frame in run.frames}
    return np.array([by_frame[int(frame)] for frame in item.frame_id])


def by_pose(values: Array, poses: NDArray[np.int64]) -> Array:
    """(p,) mean over the rows of each pose, of (n, ...) values; NaN where it has none."""
    rows = frame_means(values)
    names, place = np.unique(poses, return_inverse=True)
    known = np.isfinite(rows)
    with np.errstate(invalid="ignore"):
        return np.bincount(place[known], rows[known], len(names)) / np.bincount(place[known], minlength=len(names))


def counted(number: int, what: str) -> str:
    """`1 frame`, `2 frames`."""
    return f"{number} {what}{'' if number == 1 else 's'}"
