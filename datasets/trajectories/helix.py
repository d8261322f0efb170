"""The paper's helix."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np

from datasets.trajectories.view import KIND_MEANING, MAX_POSES, PosedFrame
from eposit import Pose
from eposit.arrays import Array
from eposit.pose import rotation_error_vector, rotation_from_euler
from render.motion import PoseRate
from render.targets import Target

HALF_STEP_S = 0.005  # of the helix's central difference: rounding and curvature both stay below 1e-9 of the rate


@dataclass(frozen=True, slots=True, kw_only=True)
class Helix:
    """A helix about the optical axis while the target turns evenly about all three axes of the camera.

    X = radius cos(phase + t), Y = radius sin(phase + t), Z = depth + depth_rate t, with t in degrees and in seconds
    alike; each angle is angle + angle_rate t, R = Rz Ry Rx.

    Raises:
        ValueError: no times, or a step or depth that is not positive.
    Source:
        Paper, section III. The start angles and the range of t are not in its text; they are inferred from its code.
    """

    kind: Annotated[Literal["helix"], KIND_MEANING] = "helix"
    point: Annotated[
        Literal["board_centre", "origin"] | tuple[float, float, float],
        "point of the target that the helix carries: board_centre, origin, or [x, y, z] in mm",
    ] = "board_centre"
    start: Annotated[float, "first time t, s"] = 0.0
    stop: Annotated[float, "last time t, s, included if a step falls on it"] = 360.0
    step: Annotated[float, "time between frames, s"] = 1.0
    radius_mm: Annotated[float, "radius of the helix, mm; the paper's 100 sqrt 2"] = 141.4213562373095
    phase_deg: Annotated[float, "angle on the helix at t = 0, degrees"] = 45.0
    depth_mm: Annotated[float, "depth at t = 0, mm"] = 2000.0
    depth_rate_mm_per_s: Annotated[float, "change of depth, mm/s"] = 0.25
    angle_deg: Annotated[tuple[float, float, float], "rx, ry, rz at t = 0, degrees"] = (20.0, 20.0, 20.0)
    angle_rate_deg_per_s: Annotated[float, "change of each angle, degrees/s"] = 0.1

    def __post_init__(self) -> None:
        if not self.step > 0.0:
            raise ValueError(f"trajectory step is {self.step}; it must be above 0 s")
        if not self.stop >= self.start:
            raise ValueError(f"trajectory stop is {self.stop} and start {self.start}; stop must not come first")
        if (self.stop - self.start) / self.step > MAX_POSES:
            raise ValueError(f"trajectory has more than {MAX_POSES} poses; use a larger step")

    @property
    def count(self) -> int:
        """Number of poses."""
        return int(np.floor((self.stop - self.start) / self.step + 1e-9)) + 1

    def time_s(self, pose_id: int) -> float:
        """Time of a pose, s."""
        return self.start + self.step * pose_id

    def times(self) -> Array:
        """(count,) times of all poses, s."""
        return np.array([self.time_s(pose_id) for pose_id in range(self.count)])

    def cam_from_obj(self, time_s: float, target: Target) -> Pose:
        """Pose of the object frame at a time; t is the position of the target's origin, mm."""
        angle = np.deg2rad(self.phase_deg + time_s)
        R = rotation_from_euler(np.deg2rad(np.array(self.angle_deg) + self.angle_rate_deg_per_s * time_s))
        depth = self.depth_mm + self.depth_rate_mm_per_s * time_s
        carried = np.array([self.radius_mm * np.cos(angle), self.radius_mm * np.sin(angle), depth])
        return Pose(R, carried - R @ self._point_in_obj(target))

    def view(self, time_s: float, target: Target) -> PosedFrame:
        """Pose and rate at a time, the rate by a central difference."""
        before, after = (self.cam_from_obj(time_s + s * HALF_STEP_S, target) for s in (-1.0, 1.0))
        turn = rotation_error_vector(after.R, before.R)
        rate = PoseRate((after.t - before.t) / (2.0 * HALF_STEP_S), turn / (2.0 * HALF_STEP_S))
        return PosedFrame(time_s, self.cam_from_obj(time_s, target), rate)

    def _point_in_obj(self, target: Target) -> Array:
        if self.point == "board_centre":
            return target.board_centre
        return np.zeros(3) if self.point == "origin" else np.array(self.point)
