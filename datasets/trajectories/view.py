"""A view of the target, and the rate at which a hand moves it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eposit import Pose
from eposit.arrays import Array
from render.motion import PoseRate
from render.targets import Target

MAX_POSES = 10_000_000_000  # of a path, whose poses are computed one by one
MAX_LISTED = 1_000_000  # which every process holds
KIND_MEANING = "helix, field, scatter or listed"
SPEED_MEANING = "speed of the hand-held board's centre in a random direction, mm/s; 0 stands still"
TURN_MEANING = "rate at which the hand-held board turns about a random axis, degrees/s"


@dataclass(frozen=True, slots=True)
class PosedFrame:
    """Where the target is and how it moves."""

    time_s: float  # on the trajectory; the pose's number where that has no time
    cam_from_obj: Pose
    rate: PoseRate
    defocus_radius_px: float | None = None  # of its pictures; None: the sensor's


def hand_held(
    pose: Pose, target: Target, speed_mm_per_s: float, turn_deg_per_s: float, rng: np.random.Generator
) -> PoseRate:
    """The rate of a board held by hand: a speed and a rate of turning about its centre, each in a random direction."""
    velocity, axis = speed_mm_per_s * random_direction(rng), random_direction(rng)
    return PoseRate.about(pose, target.board_centre, velocity, np.deg2rad(turn_deg_per_s) * axis)


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
