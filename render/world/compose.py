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
from render.targets.kinds import AnyTarget
from render.world.boards import card_shapes, stand_shapes, target_shapes
from render.world.description import World
from render.world.draw import WorldDraw
from render.world.files import require_unchanged
from render.world.materials import Material, surface
from render.world.open_air import environment, sky
from render.world.room import room
from render.world.scene_file import SceneFileError
from render.world.shapes import MeshShape, Objects
from render.world.spares import chosen, is_spare, specks
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

    @property
    def names(self) -> tuple[str, ...]:
        """Of all that can be seen; a place in it plus 1 is an object's id."""
        return tuple(name for name in self.objects if not is_spare(name))


@dataclass(frozen=True, slots=True)
class Parts:
    """What of a world is composed."""

    has_card: bool = False  # a white card in the target's place
    has_occluders: bool = True


WHOLE = Parts()


def compose(world: World, draw: WorldDraw, target: AnyTarget, light: Light, parts: Parts = WHOLE) -> Composition:
    """One draw of a world with the target in it.

    The names `board` and `circle` are the target's. Every group of things has random numbers of its own, so that more
    of one does not move the others.

    Raises:
        SceneFileError: the user's file cannot be used, or has changed.
    """
    objects = _surroundings(world, draw, target, light)
    has_medium = world.surround == "scene" and user_scene(Path(world.file), world.file_sha256).has_medium
    objects |= _things(world, draw, target, parts)
    board = card_shapes(target) if parts.has_card else target_shapes(target, functools.partial(_coat, world, draw))
    stand = stand_shapes(target, world.floor_mm) if world.surround in ("room", "sky") else {}
    if draw.has_target:
        objects |= board | stand
    else:
        objects |= (board if parts.has_card else specks(board, target)) | specks(stand, target)
    objects = _spares_last(objects)
    matrix = world_from_obj(world, target) if world.surround == "scene" else np.eye(4)
    return Composition(_in_scene(objects, matrix), matrix, world.surround != "studio", has_medium)


def _things(world: World, draw: WorldDraw, target: AnyTarget, parts: Parts) -> Objects:
    """Clutter, other boards and occluders: as many as drawn and, where each pose draws, specks up to the most."""
    found: Objects = {}
    for group, (make, name) in enumerate(((clutter, "clutter"), (other_boards, "boards"), (occluders, "occluders")), 1):
        if make is occluders and not parts.has_occluders:
            continue
        count = getattr(draw, name)
        most = getattr(world, name)[1] if world.draw == "pose" else count
        found |= chosen(make(most, target, _rng(draw, group)), count, target)
    return found


def _spares_last(objects: Objects) -> Objects:
    """The same objects in the order of their kinds, so that specks take no numbers from the others."""
    return dict(sorted(objects.items(), key=lambda item: is_spare(item[0])))


def load_scene(
    world: World, draw: WorldDraw, target: AnyTarget, light: Light, parts: Parts = WHOLE
) -> tuple[DeviceScene, Composition]:
    """The composed scene, loaded.

    Raises:
        SceneFileError: the user's scene cannot be used.
    """
    composition = compose(world, draw, target, light, parts)
    return _loaded(composition.objects), composition


def load_objects(objects: Objects, matrix: Array | None = None) -> DeviceScene:
    """A scene of objects of the object frame. matrix: (4, 4) to the scene's frame; None if that is the same."""
    return _loaded(_in_scene(objects, np.eye(4) if matrix is None else matrix))


def _loaded(objects: Objects) -> DeviceScene:
    try:
        # Not optimised: Mitsuba would merge meshes, and each object has an id of its own.
        return backend.load().load_dict({"type": "scene", **objects}, parallel=False, optimize=False)
    except RuntimeError as error:  # of a file that a plugin cannot read, such as an environment map
        raise SceneFileError(f"Mitsuba cannot load the world: {first_line(error)}; mend the file") from None


def _coat(world: World, draw: WorldDraw, reflectance: Material) -> Material:
    return surface(world.surface, draw.roughness, reflectance)


def _surroundings(world: World, draw: WorldDraw, target: AnyTarget, light: Light) -> Objects:
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
    """Meshes and descriptions in the scene's frame and in Mitsuba's types; loaded objects stay."""
    transform = backend.load().ScalarTransform4f

    def placed(thing: Any) -> Any:
        if isinstance(thing, MeshShape):
            return _mesh_object(thing, matrix)
        if isinstance(thing, dict) and "to_world" in thing:
            return thing | {"to_world": transform(matrix @ thing["to_world"])}
        return thing

    return {name: placed(thing) for name, thing in objects.items()}


def _mesh_object(shape: MeshShape, matrix: Array) -> Any:
    """Mitsuba's mesh. A mesh that is made from arrays takes its BSDF as an object, in its properties."""
    mi, mesh = backend.load(), shape.mesh
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(shape.bsdf)
    made = mi.Mesh(
        "mesh",
        vertex_count=len(mesh.vertices),
        face_count=len(mesh.faces),
        has_vertex_normals=True,
        has_vertex_texcoords=True,
        props=properties,
    )
    vertices = mesh.vertices @ matrix[:3, :3].T + matrix[:3, 3]
    normals = mesh.normals @ np.linalg.inv(matrix[:3, :3])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    parameters = mi.traverse(made)
    for name, values in (("positions", vertices), ("normals", normals), ("texcoords", mesh.uv)):
        parameters[f"vertex_{name}"] = backend.upload(values.ravel())
    parameters["faces"] = backend.upload(mesh.faces.astype(np.uint32).ravel())
    parameters.update()
    return made
