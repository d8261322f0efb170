"""One image to be made, and the random numbers of everything in it."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from datasets.recipe.cameras import CameraSpec
from eposit import Pose
from render.motion import PoseRate
from render.sensor.presets import SensorModel
from render.world import WorldDraw


class Stream(IntEnum):
    """What a random number is for."""

    RENDER = 0  # rays of a path-traced reference, keyed by frame
    POINT_NOISE = 1  # noise on truth points, keyed by pose and draw
    SENSOR = 2  # noise and the light's direction, keyed by frame
    POSE = 3  # scattered poses, keyed by pose
    HAND = 4  # rates of a hand-held board, keyed by pose
    WORLD = 5  # draws of the world, keyed by pose, or by 0 where it is drawn once


@dataclass(frozen=True, slots=True)
class Frame:
    """One image to be made."""

    frame_id: int
    pose_id: int  # frames of one pose differ by camera only
    time_s: float
    camera: CameraSpec
    cam_from_obj: Pose  # under a rolling shutter a RollingPose
    rate: PoseRate  # of the pose
    sensor: SensorModel
    render_seed: int  # 32 bits
    sensor_seed: int  # 63 bits
    world: WorldDraw


def rng_for(seed: int, stream: Stream, *key: int) -> np.random.Generator:
    """The generator of one stream of one thing: the only place where seeds are made."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(stream), *key)))
