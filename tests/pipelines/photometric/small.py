"""A small picture of the paper's board with its truth, by the closed form and a sensor with noise."""

from dataclasses import dataclass, replace

import numpy as np

from eposit import Camera, Pose
from eposit.pose import rotation_error_vector, rotation_from_euler
from render.frame import LinearImage, render_frame
from render.light import Light
from render.motion import PoseRate
from render.sensor.develop import FrameContext, develop
from render.sensor.presets import regimes
from render.targets.chessboard import Chessboard

TARGET = Chessboard()
FISHEYE = Camera(lens="equisolid", fx=276.0, fy=277.0, cx=201.0, cy=148.0, width=400, height=300)
NOISY = replace(regimes()["typical"], exposure_s=0.0)


@dataclass(frozen=True)
class Small:
    """A frame and its linear light."""

    frame: FrameContext
    linear: LinearImage

    def picture(self, sensor=NOISY, seed=1):
        """(height, width) 8-bit grey values."""
        return develop(self.linear.full(self.frame.camera), sensor, replace(self.frame, seed=seed))

    def error(self, pose):
        """(6,) rotation vector, rad, and translation, mm."""
        true = self.frame.cam_from_obj
        return np.concatenate((rotation_error_vector(pose.R, true.R), pose.t - true.t))


def small(camera=FISHEYE, angles=(0.2, -0.3, 0.4), centre=(60.0, -40.0, 1500.0), light=None):
    """The board's centre at `centre`, turned by Euler angles, rad."""
    R = rotation_from_euler(angles)
    pose = Pose(R, np.array(centre) - R @ TARGET.board_centre)
    linear = render_frame(TARGET, light or Light(), camera, pose, samples=64)
    rate = PoseRate(np.zeros(3), np.zeros(3))
    return Small(FrameContext(TARGET, camera, pose, rate, linear.region, 1), linear)
