"""A world made ready for hybrid pictures: its scene loaded, its light baked, both once for all frames."""

from __future__ import annotations

import functools
from typing import Any  # Any: Mitsuba's integrators have no common type in its stubs

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
from render.pathtraced.picture import prepared
from render.pathtraced.tiles import Tracer
from render.targets.chessboard import Chessboard
from render.targets.kinds import AnyTarget
from render.world import World, WorldDraw
from render.world.boards import target_shapes
from render.world.compose import load_objects
from render.world.materials import surface


@functools.lru_cache(maxsize=1)
def baked_light(world: World, draw: WorldDraw, target: AnyTarget, light: Light) -> BakedLight:
    """Bake the light that a world throws on its target; the same bits for the same values.

    Raises:
        ValueError: no light reaches the target, or the user's scene cannot be used.
    """
    return baker(world, draw, target, light).bake(target)


def baker(world: World, draw: WorldDraw, target: AnyTarget, light: Light) -> Baker:
    """The world's scene, ready for its light to be baked.

    Raises:
        ValueError: no light reaches the target, or the user's scene cannot be used.
    """
    tracer, _ = prepared(world, draw, target, light)
    return Baker(
        scene=tracer.scene,
        placement=Placement(tracer.composition.world_from_obj),
        path=_path_beyond(world, tracer),
        sheet=_coat(world, draw).paint,
        samples=world.bake_samples,
        seed=draw.layout_seed & 0xFFFFFFFF,
    )


@functools.lru_cache(maxsize=1)
def hybrid_scene(world: World, draw: WorldDraw, target: AnyTarget, light: Light, baked: BakedLight) -> HybridScene:
    """All that pictures of the world share.

    Raises:
        ValueError: no light reaches the target, or the user's scene cannot be used.
    """
    tracer, gain = prepared(world, draw, target, light)
    circle = target.circle if isinstance(target, Chessboard) else 0.0
    traced = TracedScene(
        scene=tracer.scene,
        target=_target_alone(target),
        placement=Placement(tracer.composition.world_from_obj),
        path=tracer.integrator,
        path_beyond=_path_beyond(world, tracer),
        escaped=0.0 if tracer.composition.shows_emitters else light.background,
    )
    return HybridScene(
        target=target,
        closed=closed_target(target, baked),
        traced=traced,
        coat=_coat(world, draw),
        disc_radiance=(np.float32(circle) * baked.disc).astype(np.float32),
        rays=Rays(world.layer_samples, world.background_samples, world.path_samples),
        gain=gain,
        has_surroundings=world.surround != "studio" or not world.is_empty,
    )


@functools.lru_cache(maxsize=1)
def _target_alone(target: AnyTarget) -> DeviceScene:
    return load_objects(target_shapes(target, lambda reflectance: surface("matt", 0.0, reflectance)))


def _coat(world: World, draw: WorldDraw) -> Coat:
    return coat(surface(world.surface, draw.roughness, WHITE))


def _path_beyond(world: World, tracer: Tracer) -> Any:
    """The integrator for what follows a first reflection: its paths are one shorter, and it sees all lamps."""
    kind = "volpath" if tracer.composition.has_medium else "path"
    return backend.load().load_dict({"type": kind, "max_depth": world.path_depth - 1})
