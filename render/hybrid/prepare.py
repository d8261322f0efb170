"""A world made ready for hybrid pictures: its scene loaded, its light baked, both once for all frames."""

from __future__ import annotations

import functools
from typing import Any  # Any: Mitsuba describes integrators by dictionaries of mixed values

import numpy as np

from render import backend
from render.device import DeviceScene
from render.hybrid.bake import BakedLight, Baker
from render.hybrid.closed_layers import closed_target
from render.hybrid.coat import WHITE, Coat, coat
from render.hybrid.picture import HybridScene, Rays
from render.hybrid.placement import Placement
from render.hybrid.traced_layers import TracedScene
from render.light import Light
from render.targets.chessboard import Chessboard
from render.world import World, WorldDraw
from render.world.boards import target_shapes
from render.world.compose import load_objects, load_scene
from render.world.materials import surface


def baked_light(world: World, draw: WorldDraw, target: Chessboard, light: Light) -> BakedLight:
    """Bake the light that a world throws on its target; the same bits for the same values."""
    return baker(world, draw, target, light).bake(target)


def baker(world: World, draw: WorldDraw, target: Chessboard, light: Light) -> Baker:
    """The world's scene, ready for its light to be baked."""
    scene, composition = load_scene(world, draw, target, light)
    return Baker(
        scene=scene,
        placement=Placement(composition.world_from_obj),
        path=_path(world.path_depth - 1),
        sheet=_coat(world, draw).paint,
        samples=world.bake_samples,
        seed=draw.layout_seed & 0xFFFFFFFF,
    )


def hybrid_scene(world: World, draw: WorldDraw, target: Chessboard, light: Light, baked: BakedLight) -> HybridScene:
    """All that pictures of the world share."""
    scene, composition = load_scene(world, draw, target, light)
    traced = TracedScene(
        scene=scene,
        target=_target_alone(target),
        placement=Placement(composition.world_from_obj),
        path=_path(world.path_depth, hide_emitters=not composition.shows_emitters),
        path_beyond=_path(world.path_depth - 1),
        escaped=0.0 if composition.shows_emitters else light.background,
    )
    rays = Rays(world.layer_samples, world.background_samples, world.path_samples)
    disc_radiance = (np.float32(target.circle) * baked.disc).astype(np.float32)
    return HybridScene(target, closed_target(target, baked), traced, _coat(world, draw), disc_radiance, rays)


@functools.lru_cache(maxsize=2)
def _target_alone(target: Chessboard) -> DeviceScene:
    return load_objects(target_shapes(target, lambda reflectance: surface("matt", 0.0, reflectance)))


def _coat(world: World, draw: WorldDraw) -> Coat:
    return coat(surface(world.surface, draw.roughness, WHITE))


def _path(depth: int, *, hide_emitters: bool = False) -> Any:
    return backend.load().load_dict({"type": "path", "max_depth": depth, "hide_emitters": hide_emitters})
