"""Listed poses: pictures as someone took them, one by one, each in or out of focus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from datasets.trajectories.view import KIND_MEANING, MAX_LISTED, SPEED_MEANING, TURN_MEANING, check_hand
from eposit import Pose
from eposit.pose import rotation_from_euler
from render.sensor.presets import SensorModel
from render.targets import Target


@dataclass(frozen=True, slots=True, kw_only=True)
class ListedPose:
    """Where the board stands in one picture.

    Raises:
        ValueError: a defocus that no sensor takes.
    """

    centre_mm: Annotated[tuple[float, float, float], "x, y, z of the board's centre, camera axes, mm"]
    angle_deg: Annotated[tuple[float, float, float], "rx, ry, rz of the board, degrees"] = (0.0, 0.0, 0.0)
    defocus_radius_px: Annotated[
        float | None, "radius of the disc that a point out of focus becomes here, px; the sensor's if left out"
    ] = None

    def __post_init__(self) -> None:
        if self.defocus_radius_px is not None:
            SensorModel(defocus_radius_px=self.defocus_radius_px)

    def cam_from_obj(self, target: Target) -> Pose:
        """Pose of the object frame; t is the position of the target's origin, mm."""
        R = rotation_from_euler(np.deg2rad(self.angle_deg))
        return Pose(R, np.array(self.centre_mm) - R @ target.board_centre)


@dataclass(frozen=True, slots=True, kw_only=True)
class Listed:
    """Chosen poses in their order.

    Raises:
        ValueError: no poses, too many, or a rate out of range.
    """

    kind: Annotated[Literal["listed"], KIND_MEANING] = "listed"
    poses: Annotated[tuple[ListedPose, ...], "the poses, in their order, each a table of the keys below"]
    speed_mm_per_s: Annotated[float, SPEED_MEANING] = 100.0
    turn_deg_per_s: Annotated[float, TURN_MEANING] = 10.0

    def __post_init__(self) -> None:
        if not 1 <= len(self.poses) <= MAX_LISTED:
            raise ValueError(f"trajectory poses lists {len(self.poses)}; give 1 to {MAX_LISTED}")
        check_hand(self.speed_mm_per_s, self.turn_deg_per_s)

    @property
    def count(self) -> int:
        """Number of poses."""
        return len(self.poses)

    def pose(self, pose_id: int, target: Target) -> Pose:
        """A pose by its number."""
        return self.poses[pose_id].cam_from_obj(target)
