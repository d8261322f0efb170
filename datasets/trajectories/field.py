"""Views at chosen angles from the optical axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from datasets.trajectories.view import KIND_MEANING, MAX_POSES, SPEED_MEANING, TURN_MEANING, check_hand
from eposit import Pose
from eposit.pose import rotation_from_vector
from render.targets import Target


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldAngles:
    """The board's centre at every field angle, distance and azimuth, the board facing the camera but for a tilt.

    The board's columns run along the circle of its field angle and its rows inwards, so that its short side spans
    field angles. The tilt is about an axis half-way between them.

    Raises:
        ValueError: an empty list, or a value out of range.
    """

    kind: Annotated[Literal["field"], KIND_MEANING] = "field"
    field_deg: Annotated[tuple[float, ...], "angles of the board's centre from the optical axis, degrees"] = (0.0,)
    distance_mm: Annotated[tuple[float, ...], "distances of the board's centre from the camera centre, mm"] = (1500.0,)
    azimuth_deg: Annotated[
        tuple[float, ...] | int, "angles about the optical axis, from x towards y, degrees; or how many, evenly spaced"
    ] = 4
    extra_tilt_deg: Annotated[float, "angle between the board's normal and its viewing ray, degrees"] = 10.0
    roll_deg: Annotated[float, "turn of the board about its normal, degrees"] = 0.0
    speed_mm_per_s: Annotated[float, SPEED_MEANING] = 100.0
    turn_deg_per_s: Annotated[float, TURN_MEANING] = 10.0

    def __post_init__(self) -> None:
        self._check_counts()
        self._check_values()
        check_hand(self.speed_mm_per_s, self.turn_deg_per_s)

    def _check_counts(self) -> None:
        counted = isinstance(self.azimuth_deg, int)
        if isinstance(self.azimuth_deg, int) and self.azimuth_deg < 1:
            raise ValueError(f"trajectory azimuth_deg is {self.azimuth_deg}; give a list of angles or a count above 0")
        for name in ("field_deg", "distance_mm", *(() if counted else ("azimuth_deg",))):
            if not getattr(self, name):
                raise ValueError(f"trajectory {name} is an empty list; give at least one")
        if self.count > MAX_POSES:
            raise ValueError(f"trajectory has more than {MAX_POSES} poses; give fewer angles or distances")

    def _check_values(self) -> None:
        for angle in self.field_deg:
            if not 0.0 <= angle < 180.0:
                raise ValueError(f"trajectory field_deg holds {angle:g}; field angles lie in 0 to below 180 degrees")
        for distance in self.distance_mm:
            if not distance > 0.0:
                raise ValueError(f"trajectory distance_mm holds {distance:g}; distances are above 0 mm")
        if not 0.0 <= self.extra_tilt_deg <= 85.0:
            raise ValueError(f"trajectory extra_tilt_deg is {self.extra_tilt_deg}; it must lie in 0 to 85 degrees")

    @property
    def count(self) -> int:
        """Number of poses."""
        return len(self.field_deg) * len(self.distance_mm) * self._azimuths

    @property
    def _azimuths(self) -> int:
        return self.azimuth_deg if isinstance(self.azimuth_deg, int) else len(self.azimuth_deg)

    def azimuth(self, i: int) -> float:
        """An angle about the optical axis, degrees."""
        return 360.0 * i / self.azimuth_deg if isinstance(self.azimuth_deg, int) else self.azimuth_deg[i]

    def pose(self, pose_id: int, target: Target) -> Pose:
        """A pose by its number, field angles outermost, azimuths innermost."""
        rest, azimuth = divmod(pose_id, self._azimuths)
        field, distance = divmod(rest, len(self.distance_mm))
        angles = np.deg2rad(self.field_deg[field]), np.deg2rad(self.azimuth(azimuth))
        return self._facing(*angles, self.distance_mm[distance], target)

    def _facing(self, field: float, azimuth: float, distance: float, target: Target) -> Pose:
        across = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        outwards = np.array([np.cos(field) * np.cos(azimuth), np.cos(field) * np.sin(azimuth), -np.sin(field)])
        ray = np.cross(outwards, across)
        facing = np.column_stack((across, -outwards, ray))
        roll = rotation_from_vector(np.deg2rad(self.roll_deg) * np.array([0.0, 0.0, 1.0]))
        tilt = rotation_from_vector(np.deg2rad(self.extra_tilt_deg) * np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0]))
        R = facing @ tilt @ roll
        return Pose(R, distance * ray - R @ target.board_centre)
