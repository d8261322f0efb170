"""A user's Mitsuba scene, and where the target stands in it."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np

from eposit.arrays import Array
from render import backend
from render.targets.chessboard import Chessboard
from render.world.description import World
from render.world.scene_file import SceneFile, SceneFileError, read_scene_file
from render.world.shapes import Objects


@functools.lru_cache(maxsize=2)
def user_objects(path: Path) -> Objects:
    """The shapes and emitters of a scene file, loaded; its integrator and sensors are left out.

    Raises:
        SceneFileError: the file cannot be used; Mitsuba does not know a plugin or refuses a value.
    """
    mi, scene_file = backend.load(), read_scene_file(path)
    try:
        scene = mi.load_string(scene_file.text)
    except Exception as error:  # Mitsuba raises whatever a plugin does
        raise SceneFileError(f"Mitsuba cannot load {path}: {_first_line(error)}; mend the scene") from None
    if not isinstance(scene, mi.Scene):
        raise SceneFileError(f"{path} is not a Mitsuba scene; give a file with <scene> and shapes in it")
    objects: Objects = {f"scene_{i}": shape for i, shape in enumerate(scene.shapes())}
    apart = [light for light in scene.emitters() if not mi.has_flag(light.flags(), mi.EmitterFlags.Surface)]
    objects |= {f"scene_light_{i}": light for i, light in enumerate(apart)}
    if not scene.emitters():
        raise SceneFileError(f"{path} has no light; add an emitter to the scene")
    return objects


def has_medium(scene_file: SceneFile) -> bool:
    """Whether a scene has a participating medium, which needs another path tracer."""
    return "<medium" in scene_file.text


def world_from_obj(world: World, target: Chessboard) -> Array:
    """(4, 4) from the object frame, mm, to the scene's frame and units."""
    back, up = -np.array(world.facing), np.array(world.up)
    z = back / np.linalg.norm(back)
    down = -(up - (up @ z) * z)
    y = down / np.linalg.norm(down)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack((np.cross(y, z), y, z)) / world.mm_per_unit
    matrix[:3, 3] = np.array(world.place) - matrix[:3, :3] @ target.board_centre
    return matrix


def _first_line(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return (lines[0] if lines else type(error).__name__).rstrip(".")
