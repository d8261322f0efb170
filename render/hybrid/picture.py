"""A hybrid picture: layers in closed form and traced ones, put together."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from render.analytic.image_circle import lens_coverage
from render.hybrid.bake import BakedLight
from render.hybrid.closed_layers import ClosedLayers, ClosedTarget, closed_target
from render.hybrid.coat import Coat
from render.hybrid.pixel_rays import Pixels, RayCamera
from render.hybrid.traced_layers import TracedScene
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region
