"""Which pose and which camera each frame has: poses outermost, the cameras of a pose in the recipe's order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.errors import UserError
from datasets.plan.faults import cameras_of
from datasets.plan.poses import pose_of
from datasets.recipe.model import Recipe

MOST_COUNTED = 1_000_000  # poses whose cameras are counted one by one: each process does it, and holds 8 bytes of each


@dataclass(frozen=True, slots=True)
class Even:
    """Every camera takes part in every pose: a frame's number tells all, and nothing is held."""

    poses: int
    cameras: int

    @property
    def frames(self) -> int:
        """Number of frames."""
        return self.poses * self.cameras

    def place(self, frame_id: int) -> tuple[int, int]:
        """A frame's pose, and its place among that pose's frames."""
        return divmod(frame_id, self.cameras)


@dataclass(frozen=True, slots=True, eq=False)
class Counted:
    """Poses differ in their cameras, so that a frame's number depends on every pose before it."""

    first: NDArray[np.int64]  # (poses + 1,) first frame of each pose, then the number of frames

    @property
    def frames(self) -> int:
        """Number of frames."""
        return int(self.first[-1])

    def place(self, frame_id: int) -> tuple[int, int]:
        """A frame's pose, and its place among that pose's frames."""
        pose_id = int(np.searchsorted(self.first, frame_id, side="right")) - 1
        return pose_id, frame_id - int(self.first[pose_id])


Layout = Even | Counted


def layout_of(recipe: Recipe) -> Layout:
    """The layout of a recipe; only where cameras have a `max_field_deg` is anything held.

    Raises:
        UserError: more poses than can be counted, a camera without any pose, or a scattered pose that no draw fits.
    """
    poses = recipe.trajectory.count
    if all(camera.max_field_deg is None for camera in recipe.cameras):
        return Even(poses, len(recipe.cameras))
    if poses > MOST_COUNTED:
        raise UserError(
            f"recipe {recipe.name} has {poses} poses and cameras with max_field_deg, whose frames are counted pose by "
            f"pose, at most {MOST_COUNTED}; leave max_field_deg out, or make several datasets with other seeds"
        )
    return _counted(recipe, poses)


def _counted(recipe: Recipe, poses: int) -> Counted:
    counts = np.zeros(poses, np.int64)
    idle = {camera.name: camera for camera in recipe.cameras}
    for pose_id in range(poses):
        chosen = cameras_of(recipe, pose_of(recipe, pose_id))
        counts[pose_id] = len(chosen)
        for camera in chosen:
            idle.pop(camera.name, None)
    for camera in idle.values():
        raise UserError(
            f"camera {camera.name} sees no pose, as max_field_deg is {camera.max_field_deg:g}; raise it or leave the "
            "camera out"
        )
    return Counted(np.concatenate(([0], np.cumsum(counts))))
