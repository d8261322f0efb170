"""A world as a Mitsuba scene."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any  # Any: Mitsuba describes a scene by dictionaries of mixed values

import numpy as np

from eposit.arrays import Array
from render import backend
from render.device import DeviceScene
from render.light import Light
from render.targets.chessboard import Chessboard
from render.world.boards import card_shapes, stand_shapes, target_shapes
from render.world.description import World
from render.world.draw import WorldDraw
from render.world.files import require_unchanged
from render.world.materials import Material, surface
from render.world.open_air import environment, sky
from render.world.room import room
from render.world.scene_file import SceneFileError
from render.world.shapes import Objects
from render.world.studio import studio
from render.world.things import clutter, occluders, other_boards
from render.world.user_scene import first_line, user_scene, world_from_obj


@dataclass(frozen=True)
class Composition:
    """A world, ready for Mitsuba."""

    objects: Objects  # name to Mitsuba description or object, in the scene's frame; without an integrator
    world_from_obj: Array  # (4, 4) from the object frame, mm, to the scene's frame and units; else the identity
    shows_emitters: bool  # whether the camera sees lamps, sky and environment
    has_medium: bool = False  # whether there is fog or the like


@dataclass(frozen=True, slots=True)
class Parts:
    """What of a world is composed."""

    has_card: bool = False  # a white card in the target's place
    has_occluders: bool = True


WHOLE = Parts()


def compose(world: World, draw: WorldDraw, target: Chessboard, light: Light, parts: Parts = WHOLE) -> Composition:
    """One draw of a world with the target in it.

    The names `board` and `circle` are the target's. Every group of things has random numbers of its own, so that more
    of one does not move the others.

    Raises:
        SceneFileError: the user's file cannot be used, or has changed.
    """
    objects = _surroundings(world, draw, target, light)
    has_medium = world.surround == "scene" and user_scene(Path(world.file), world.file_sha256).has_medium
    objects |= clutter(draw.clutter, target, _rng(draw, 1))
    objects |= other_boards(draw.boards, target, _rng(draw, 2))
    if parts.has_occluders:
        objects |= occluders(draw.occluders, target, _rng(draw, 3))
    if parts.has_card:
        objects |= card_shapes(target)
    elif draw.has_target:
        objects |= target_shapes(target, functools.partial(_coat, world, draw))
    if world.surround in ("room", "sky") and draw.has_target:
        objects |= stand_shapes(target, world.floor_mm)
    matrix = world_from_obj(world, target) if world.surround == "scene" else np.eye(4)
    return Composition(_in_scene(objects, matrix), matrix, world.surround != "studio", has_medium)


def load_scene(
    world: World, draw: WorldDraw, target: Chessboard, light: Light, parts: Parts = WHOLE
) -> tuple[DeviceScene, Composition]:
    """The composed scene, loaded.

    Raises:
        SceneFileError: the user's scene cannot be used.
    """
    composition = compose(world, draw, target, light, parts)
    return _loaded(composition.objects), composition


def load_objects(objects: Objects) -> DeviceScene:
    """A scene of objects in the object frame."""
    return _loaded(_in_scene(objects, np.eye(4)))


def _loaded(objects: Objects) -> DeviceScene:
    try:
        # Not optimised: Mitsuba would merge meshes, and each object has an id of its own.
        return backend.load().load_dict({"type": "scene", **objects}, optimize=False)
    except RuntimeError as error:  # of a file that a plugin cannot read, such as an environment map
        raise SceneFileError(f"Mitsuba cannot load the world: {first_line(error)}; mend the file") from None


def _coat(world: World, draw: WorldDraw, reflectance: Material) -> Material:
    return surface(world.surface, draw.roughness, reflectance)


def _surroundings(world: World, draw: WorldDraw, target: Chessboard, light: Light) -> Objects:
    if world.surround == "studio":
        return studio(target, light)
    if world.surround == "room":
        return room(world, draw, target, _rng(draw, 0))
    if world.surround == "sky":
        return sky(world, draw, target, _rng(draw, 0))
    require_unchanged(Path(world.file), world.file_sha256)
    if world.surround == "envmap":
        return environment(world, draw)
    return dict(user_scene(Path(world.file), world.file_sha256).objects)


def _rng(draw: WorldDraw, group: int) -> np.random.Generator:
    return np.random.default_rng([draw.layout_seed, group])


def _in_scene(objects: Objects, matrix: Array) -> Objects:
    """Descriptions with their matrices in the scene's frame and in Mitsuba's type; loaded objects stay."""
    transform = backend.load().ScalarTransform4f

    def placed(thing: Any) -> Any:
        if isinstance(thing, dict) and "to_world" in thing:
            return thing | {"to_world": transform(matrix @ thing["to_world"])}
        return thing

    return {name: placed(thing) for name, thing in objects.items()}
