"""Mitsuba scenes of the target alone. The object frame is the world frame: the board stands still, the camera moves.

Our own pictures need no scene (`render.analytic.integrate`); the reference and the benchmarks do.
"""

from __future__ import annotations

import functools

from render.device import DeviceScene
from render.light import Light
from render.targets.chessboard import Chessboard
from render.world.boards import target_shapes
from render.world.compose import load_objects
from render.world.materials import Material, surface
from render.world.studio import studio


@functools.lru_cache(maxsize=4)
def bare_scene(target: Chessboard) -> DeviceScene:
    """The target's shapes and reflectance without any light, for rays that only ask what they hit."""
    return load_objects(target_shapes(target, _matt))


@functools.lru_cache(maxsize=4)
def reference_scene(target: Chessboard, light: Light) -> DeviceScene:
    """The same board under a real lamp and a real surrounding, for Mitsuba's own integrator: the oracle."""
    integrator = {"type": "direct", "emitter_samples": 4, "bsdf_samples": 0, "hide_emitters": True}
    return load_objects({"integrator": integrator, **target_shapes(target, _matt), **studio(target, light)})


def _matt(reflectance: Material) -> Material:
    return surface("matt", 0.0, reflectance)
