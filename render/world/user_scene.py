"""A user's Mitsuba scene, and where the target stands in it."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from eposit.arrays import Array
from render import backend
from render.targets.kinds import AnyTarget
from render.world.description import World
from render.world.scene_file import SceneFileError, read_scene_file
from render.world.shapes import Objects


@dataclass(frozen=True)
class UserScene:
    """The shapes and emitters of a scene file, loaded; its integrator and sensors are left out."""

    objects: Objects
    has_medium: bool  # whether there is fog or the like, which needs another path tracer


@functools.lru_cache(maxsize=2)
def user_scene(path: Path, sha256: str) -> UserScene:
    """Load a scene file. sha256: of what it is, so that another one in its place is not taken for it.

    Raises:
        SceneFileError: the file cannot be used; Mitsuba does not know a plugin or refuses a value.
    """
    mi, scene_file = backend.load(), read_scene_file(path)
    try:
        scene = mi.load_string(scene_file.text, parallel=False, optimize=False)
    except Exception as error:  # Mitsuba raises whatever a plugin does
        raise SceneFileError(f"Mitsuba cannot load {path}: {first_line(error)}; mend the scene") from None
    if not isinstance(scene, mi.Scene):
        raise SceneFileError(f"{path} is not a Mitsuba scene; give a file with <scene> and shapes in it")
    objects: Objects = {}
    for i, shape in enumerate(scene.shapes()):
        name = f"scene_{i}_{shape.id()}".replace(".", "_")  # Mitsuba takes no dots in a name
        shape.set_id(name)
        objects[name] = shape
    apart = [light for light in scene.emitters() if not mi.has_flag(light.flags(), mi.EmitterFlags.Surface)]
    objects |= {f"scene_light_{i}": light for i, light in enumerate(apart)}
    if not scene.emitters():
        raise SceneFileError(f"{path} has no light; add an emitter to the scene")
    return UserScene(objects, "<medium" in scene_file.text)


def world_from_obj(world: World, target: AnyTarget) -> Array:
    """(4, 4) from the object frame, mm, to the scene's frame and units."""
    back, up = -np.array(world.facing), np.array(world.up)
    z = back / np.linalg.norm(back)
    down = -(up - (up @ z) * z)
    y = down / np.linalg.norm(down)
    matrix = np.eye(4)
    matrix[:3, :3] = np.column_stack((np.cross(y, z), y, z)) / world.mm_per_unit
    matrix[:3, 3] = np.array(world.place) - matrix[:3, :3] @ target.board_centre
    return matrix


def first_line(error: Exception) -> str:
    """The first line of what Mitsuba says, to stand in a sentence."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return (lines[0] if lines else type(error).__name__).rstrip(".")
