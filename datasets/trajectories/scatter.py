"""Scattered poses: random within ranges, each from its own random numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from datasets.trajectories.view import KIND_MEANING, MAX_POSES, SPEED_MEANING, TURN_MEANING, check_hand
from eposit import Camera, Pose
from eposit.arrays import Array
from eposit.pose import rotation_from_vector
from render.targets import Target

MAX_TRIES = 2000
Range = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scatter:
    """Random poses, each drawn again until every camera that is planned for it holds the whole target.

    Depth, roll and tilt are uniform in their ranges, the direction of the tilt is uniform, and the board's centre is
    uniform over a ring about the axis at its depth, or over the first camera's picture.

    Raises:
        ValueError: a value out of range.
    """

    kind: Annotated[Literal["scatter"], KIND_MEANING] = "scatter"
    count: Annotated[int, "number of poses"] = 40
    depth_range_mm: Annotated[Range, "least and largest depth of the board's centre, mm"] = (2000.0, 2000.0)
    offset_range_mm: Annotated[
        Range | Literal["picture"],
        'least and largest distance of the board\'s centre from the optical axis, mm; or "picture", all of it',
    ] = (0.0, 300.0)
    tilt_range_deg: Annotated[Range, "least and largest angle between board normal and optical axis, degrees"] = (
        0.0,
        30.0,
    )
    roll_range_deg: Annotated[Range, "least and largest turn of the board about its normal, degrees"] = (-180.0, 180.0)
    speed_mm_per_s: Annotated[float, SPEED_MEANING] = 100.0
    turn_deg_per_s: Annotated[float, TURN_MEANING] = 10.0

    def __post_init__(self) -> None:
        if not 1 <= self.count <= MAX_POSES:
            raise ValueError(f"trajectory count is {self.count}; it must lie in 1 to {MAX_POSES}")
        limits = {
            "depth_range_mm": (1.0, 1e6, "mm"),
            "offset_range_mm": (0.0, 1e6, "mm"),
            "tilt_range_deg": (0.0, 89.0, "degrees"),
            "roll_range_deg": (-360.0, 360.0, "degrees"),
        }
        for name, (least, most, unit) in limits.items():
            given = getattr(self, name)
            if given != "picture" and not least <= given[0] <= given[1] <= most:
                allowed = f"{least:g} to {most:g} {unit}"
                raise ValueError(f"trajectory {name} is {list(given)}; give the least and the largest, in {allowed}")
        check_hand(self.speed_mm_per_s, self.turn_deg_per_s)

    def pose(
        self, rng: np.random.Generator, target: Target, first: Camera, fits: Callable[[Pose], bool]
    ) -> Pose | None:
        """The first drawn pose that fits, or None after MAX_TRIES.

        first: the camera over whose picture `offset_range_mm = "picture"` spreads.
        """
        for _ in range(MAX_TRIES):
            pose = self._draw(rng, target, first)
            if np.all(np.isfinite(pose.t)) and fits(pose):
                return pose
        return None

    def _draw(self, rng: np.random.Generator, target: Target, first: Camera) -> Pose:
        depth, roll, tilt = (
            rng.uniform(*limits) for limits in (self.depth_range_mm, self.roll_range_deg, self.tilt_range_deg)
        )
        towards = rng.uniform(0.0, 2.0 * np.pi)
        leaning = rotation_from_vector(np.deg2rad(tilt) * np.array([np.cos(towards), np.sin(towards), 0.0]))
        R = leaning @ rotation_from_vector(np.deg2rad(roll) * np.array([0.0, 0.0, 1.0]))
        return Pose(R, self._centre(rng, depth, first) - R @ target.board_centre)

    def _centre(self, rng: np.random.Generator, depth: float, first: Camera) -> Array:
        """(3,) place of the board's centre, mm; NaN where the lens shows no ray or one that never has this depth."""
        if isinstance(self.offset_range_mm, str):
            bearing = first.bearing(rng.uniform((-0.5, -0.5), (first.width - 0.5, first.height - 0.5)))
            return bearing * (depth / bearing[2]) if bearing[2] > 1e-6 else np.full(3, np.nan)
        near, far = self.offset_range_mm
        radius, angle = np.sqrt(rng.uniform(near**2, far**2)), rng.uniform(0.0, 2.0 * np.pi)
        return np.array([radius * np.cos(angle), radius * np.sin(angle), depth])
