"""A facing board through a small pinhole camera, and a sensor that neither blurs nor adds noise."""

import numpy as np

from eposit import Camera, Pose
from render.motion import PoseRate
from render.sensor.develop import FrameContext
from render.sensor.presets import SensorModel
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region

TARGET = Chessboard()
CAMERA = Camera(lens="perspective", fx=400.0, fy=400.0, cx=199.5, cy=149.5, width=400, height=300)
FACING = Pose(np.eye(3), np.array([0.0, 0.0, 2000.0]) - TARGET.board_centre)
STILL = PoseRate(np.zeros(3), np.zeros(3))
WHOLE = Region.whole(CAMERA.width, CAMERA.height)
BARE = SensorModel(exposure=1.0, psf_sigma_px=0.0)


def shot(seed=0, rate=STILL, pose=FACING, camera=CAMERA, region=WHOLE):
    return FrameContext(TARGET, camera, pose, rate, region, seed)


def flat(value):
    return np.full((CAMERA.height, CAMERA.width), value, np.float32)
