"""Worlds, cameras and poses in which hybrid pictures are measured."""

from __future__ import annotations

import numpy as np

from eposit import Camera, Pose
from eposit.pose import rotation_from_euler
from render.light import Light
from render.targets.chessboard import Chessboard
from render.world import World, WorldDraw, draw_world
from tests.cameras import paper_camera

TARGET, LIGHT = Chessboard(), Light()
LENSES = ("perspective", "stereographic", "equidistance", "equisolid", "orthogonal")
THINGS = {"clutter": (8, 8)}
SCENES = {
    "room": {"surround": "room", **THINGS},
    "sky": {"surround": "sky", "rotation_range_deg": (20.0, 20.0), **THINGS},
    "glossy": {"surround": "room", "surface": "rough_plastic", **THINGS},
    "laminated": {"surround": "sky", "surface": "laminated", "sun_elevation_range_deg": (25.0, 25.0)},
    "occluded": {"surround": "room", "surface": "rough_plastic", "occluders": (1, 1), **THINGS},
}
DEPTH_MM = {"perspective": 2600.0}  # of the board's centre; elsewhere 1100 mm


def world_of(scene: str, bake_samples: int) -> tuple[World, WorldDraw]:
    """One of `SCENES` with its only draw."""
    world = World(method="hybrid", bake_samples=bake_samples, background_samples=4, **SCENES[scene])
    return world, draw_world(world, np.random.default_rng(5))


def scaled_camera(lens: str, scale: float) -> Camera:
    """The paper's camera with its picture scaled."""
    camera = paper_camera(lens)
    return camera.replace(
        fx=scale * camera.fx,
        fy=scale * camera.fy,
        cx=scale * (camera.cx + 0.5) - 0.5,
        cy=scale * (camera.cy + 0.5) - 0.5,
        width=round(scale * camera.width),
        height=round(scale * camera.height),
    )


def pose_of(lens: str, tilt_deg: float = 25.0) -> Pose:
    """The board near the middle of the picture, turned about all axes."""
    R = rotation_from_euler(np.deg2rad([tilt_deg, -0.6 * tilt_deg, 9.0]))
    return Pose(R, np.array([30.0, -20.0, DEPTH_MM.get(lens, 1100.0)]) - R @ TARGET.board_centre)
