"""A frame's board, lamp and camera in Blender's terms, for `script.py`: metres, plain numbers and lists."""

from __future__ import annotations

from typing import Any

import numpy as np

from datasets.plan import Frame
from datasets.recipe.model import Recipe
from eposit import Camera, Pose
from eposit.arrays import Array
from render.light import Light
from render.targets.chessboard import Chessboard
from render.world.studio import radiances

LENS = "equisolid"  # the lens that Cycles and we both have
LENS_MM = 10.5  # any focal length does, as the sensor's width is chosen to match
METRES = 1e-3  # in a millimetre
RIM = 256  # corners of the disc: it is 0.002 mm too small between them


def description(recipe: Recipe, frame: Frame, samples: int, threads: int) -> dict[str, Any]:
    """What Blender is told; its world is the object frame in metres.

    samples: rays for each pixel.
    Raises:
        ValueError: the camera's lens is not the one that Cycles has.
    """
    target, camera = recipe.target, frame.camera.true_camera()
    lamp, surrounding = radiances(target, recipe.light)
    return {
        "board": _board(target),
        "disc": {"rim": (METRES * target.circle_rim(RIM)).tolist(), "reflectance": target.circle},
        "lamp": _lamp(target, recipe.light, lamp),
        "surrounding": surrounding,
        "camera": _camera(camera, frame.cam_from_obj),
        "samples": samples,
        "threads": threads,
    }


def _board(target: Chessboard) -> dict[str, Any]:
    """Corners, their places in the map of reflectance, and that map: a texel for a square, u along x, v along y."""
    x0, x1, y0, y1 = target.extent_mm
    corners = np.array([(x0, y0, 0.0), (x1, y0, 0.0), (x1, y1, 0.0), (x0, y1, 0.0)])
    squares = np.array([target.columns + 2, target.rows + 2])  # with a ring of margin, which goes on beyond
    return {
        "corners": (METRES * corners).tolist(),
        "uv": ((corners[:, :2] / target.square_mm + 2.0) / squares).tolist(),
        "reflectance": target.reflectance().tolist(),
    }


def _lamp(target: Chessboard, light: Light, radiance: float) -> dict[str, Any]:
    """A square lamp that shines along its -z; its power is that of an even radiance into the half space.

    Cycles lets the surrounding shine through its lamps, which makes the demo's board 0.8 % brighter than ours.
    """
    corners = METRES * light.lamp_corners(target)
    along, toward = corners[1] - corners[0], METRES * target.board_centre - corners.mean(axis=0)
    side = float(np.linalg.norm(along))
    x, z = along / side, -toward / np.linalg.norm(toward)
    axes = np.column_stack((x, np.cross(z, x), z))
    return {"to_world": _matrix(axes, corners.mean(axis=0)), "side": side, "watts": radiance * np.pi * side**2}


def _camera(camera: Camera, cam_from_obj: Pose) -> dict[str, Any]:
    """Blender's camera looks along its -z with y up. Its sensor is as wide as the picture, whose pixels are not square.

    The shifts are shares of the picture's width and height by which the picture is moved over the lens, right and up.
    """
    if camera.lens != LENS:
        raise ValueError(f"camera has the lens {camera.lens!r}; Cycles is compared through {LENS!r} only")
    obj_from_cam = cam_from_obj.inverse()
    return {
        "to_world": _matrix(obj_from_cam.R * (1.0, -1.0, -1.0), METRES * obj_from_cam.t),
        "lens_mm": LENS_MM,
        "field": 2.0 * camera.law.theta_max,
        "sensor_width_mm": LENS_MM * camera.width / camera.fx,
        "pixel_aspect": [max(1.0, camera.fy / camera.fx), max(1.0, camera.fx / camera.fy)],
        "shift": [0.5 - (camera.cx + 0.5) / camera.width, (camera.cy + 0.5) / camera.height - 0.5],
        "size": [camera.width, camera.height],
    }


def _matrix(axes: Array, origin: Array) -> list[list[float]]:
    """4 x 4, rows."""
    return [*np.column_stack((axes, origin)).tolist(), [0.0, 0.0, 0.0, 1.0]]
