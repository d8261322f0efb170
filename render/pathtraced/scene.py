"""Mitsuba scenes of the target. The object frame is the world frame: the board stands still and the camera moves.

Our own pictures need no scene (`render.analytic.integrate`); the reference and the benchmarks do.
"""

from __future__ import annotations

import functools

import numpy as np

from render import backend
from render.device import DeviceScene
from render.light import Light, reference_irradiance
from render.pathtraced.target_objects import target_objects
from render.targets.kinds import AnyTarget


@functools.lru_cache(maxsize=4)
def bare_scene(target: AnyTarget) -> DeviceScene:
    """The target's shapes and reflectance without any light, for rays that only ask what they hit."""
    mi = backend.load()
    return mi.load_dict({"type": "scene", **target_objects(target)})


@functools.lru_cache(maxsize=4)
def reference_scene(target: AnyTarget, light: Light) -> DeviceScene:
    """The same board under a real lamp and a real surrounding, for Mitsuba's own integrator: the oracle."""
    mi = backend.load()
    corners = light.lamp_corners(target)
    edge_a, edge_b = (corners[1] - corners[0]) / 2.0, (corners[3] - corners[0]) / 2.0
    normal = np.cross(edge_a, edge_b)
    to_board = target.board_centre - corners.mean(axis=0)
    facing = 1.0 if normal @ to_board > 0.0 else -1.0
    frame = np.eye(4)
    frame[:3] = np.column_stack((edge_a, facing * edge_b, facing * np.cross(edge_a, edge_b), corners.mean(axis=0)))
    lamp_radiance, ambient_radiance = radiances(target, light)
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "direct", "emitter_samples": 4, "bsdf_samples": 0, "hide_emitters": True},
            **target_objects(target),
            "lamp": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f(frame),
                "emitter": {"type": "area", "radiance": {"type": "uniform", "value": lamp_radiance}},
            },
            "surrounding": {"type": "constant", "radiance": {"type": "uniform", "value": ambient_radiance}},
        }
    )


def radiances(target: AnyTarget, light: Light) -> tuple[float, float]:
    """Radiance of the lamp and of the surrounding that give the board's white at its centre radiance 1."""
    lamp, ambient = reference_irradiance(target, light)
    lamp_radiance = (1.0 - light.ambient_share) * np.pi / target.white / lamp
    return float(lamp_radiance), light.ambient_share / target.white / ambient
