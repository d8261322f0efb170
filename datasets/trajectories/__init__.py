"""Where the target stands in front of the camera: the paper's helix, chosen field angles, scattered or listed poses."""

from __future__ import annotations

from datasets.trajectories.field import FieldAngles
from datasets.trajectories.helix import Helix
from datasets.trajectories.listed import Listed
from datasets.trajectories.scatter import Scatter

Trajectory = Helix | FieldAngles | Scatter | Listed
TRAJECTORIES: dict[str, type[Trajectory]] = {
    "helix": Helix,
    "field": FieldAngles,
    "scatter": Scatter,
    "listed": Listed,
}
