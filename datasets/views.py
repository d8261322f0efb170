"""A view of the target, hand-held or not, and views at chosen angles from the optical axis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from eposit import Pose
from eposit.arrays import Array
from eposit.pose import rotation_from_vector
from render.motion import Rate
from render.target import Target

MAX_POSES = 1_000_000
SPEED_MEANING = "speed of the hand-held board's centre in a random direction, mm/s; 0 stands still"
TURN_MEANING = "rate at which the hand-held board turns about a random axis, degrees/s"


@dataclass(frozen=True, slots=True)
class View:
    """Where the target is and how it moves."""

    time_s: float  # on the trajectory; the pose's number where that has no time
    cam_from_obj: Pose
    rate: Rate
    defocus_radius_px: float | None = None  # of its pictures; None: the sensor's


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldAngles:
    """The board's centre at every field angle, distance and azimuth, the board facing the camera but for a tilt.

    The board's columns run along the circle of its field angle and its rows inwards, so that its short side spans
    field angles. The tilt is about an axis half-way between them.

    Raises:
        ValueError: an empty list, or a value out of range.
    """

    kind: Annotated[Literal["field"], "helix, field, scatter or listed"] = "field"
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
        counted = isinstance(self.azimuth_deg, int)
        if isinstance(self.azimuth_deg, int) and self.azimuth_deg < 1:
            raise ValueError(f"trajectory azimuth_deg is {self.azimuth_deg}; give a list of angles or a count above 0")
        for name in ("field_deg", "distance_mm", *(() if counted else ("azimuth_deg",))):
            if not getattr(self, name):
                raise ValueError(f"trajectory {name} is an empty list; give at least one")
        for angle in self.field_deg:
            if not 0.0 <= angle < 180.0:
                raise ValueError(f"trajectory field_deg holds {angle:g}; field angles lie in 0 to below 180 degrees")
        for distance in self.distance_mm:
            if not distance > 0.0:
                raise ValueError(f"trajectory distance_mm holds {distance:g}; distances are above 0 mm")
        if not 0.0 <= self.extra_tilt_deg <= 85.0:
            raise ValueError(f"trajectory extra_tilt_deg is {self.extra_tilt_deg}; it must lie in 0 to 85 degrees")
        check_hand(self.speed_mm_per_s, self.turn_deg_per_s)
        if len(self.field_deg) * len(self.distance_mm) * len(self.azimuths) > MAX_POSES:
            raise ValueError("trajectory has more than a million poses; give fewer angles or distances")

    @property
    def azimuths(self) -> tuple[float, ...]:
        """Angles about the optical axis, degrees."""
        given = self.azimuth_deg
        return tuple(360.0 * i / given for i in range(given)) if isinstance(given, int) else given

    def poses(self, target: Target) -> list[Pose]:
        """Poses, field angles outermost, azimuths innermost."""
        return [
            self._pose(np.deg2rad(field), distance, np.deg2rad(azimuth), target)
            for field in self.field_deg
            for distance in self.distance_mm
            for azimuth in self.azimuths
        ]

    def _pose(self, field: float, distance: float, azimuth: float, target: Target) -> Pose:
        across = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
        outwards = np.array([np.cos(field) * np.cos(azimuth), np.cos(field) * np.sin(azimuth), -np.sin(field)])
        ray = np.cross(outwards, across)
        facing = np.column_stack((across, -outwards, ray))
        roll = rotation_from_vector(np.deg2rad(self.roll_deg) * np.array([0.0, 0.0, 1.0]))
        tilt = rotation_from_vector(np.deg2rad(self.extra_tilt_deg) * np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0]))
        R = facing @ tilt @ roll
        return Pose(R, distance * ray - R @ target.board_centre)


def hand_held(
    pose: Pose, target: Target, speed_mm_per_s: float, turn_deg_per_s: float, rng: np.random.Generator
) -> Rate:
    """The rate of a board held by hand: a speed and a rate of turning about its centre, each in a random direction."""
    velocity, axis = speed_mm_per_s * random_direction(rng), random_direction(rng)
    return Rate.about(pose, target.board_centre, velocity, np.deg2rad(turn_deg_per_s) * axis)


def random_direction(rng: np.random.Generator) -> Array:
    """(3,) unit vector, uniform over the sphere."""
    vector = rng.standard_normal(3)
    return vector / np.linalg.norm(vector)


def check_hand(speed_mm_per_s: float, turn_deg_per_s: float) -> None:
    """Refuse rates of a hand that are no rates.

    Raises:
        ValueError: below 0, or faster than any hand.
    """
    if not 0.0 <= speed_mm_per_s <= 1e5:
        raise ValueError(f"trajectory speed_mm_per_s is {speed_mm_per_s}; it must lie in 0 to 100000 mm/s")
    if not 0.0 <= turn_deg_per_s <= 3600.0:
        raise ValueError(f"trajectory turn_deg_per_s is {turn_deg_per_s}; it must lie in 0 to 3600 degrees/s")
