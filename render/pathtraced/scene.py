"""Mitsuba scenes of the target. The object frame is the world frame: the board stands still and the camera moves.

Our own pictures need no scene (`render.analytic.integrate`); the reference and the benchmarks do.
"""

from __future__ import annotations

import functools
from typing import Any  # Any: Mitsuba describes a scene by dictionaries of mixed values

import numpy as np

from render import backend
from render.device import DeviceScene
from render.light import Light, reference_irradiance
from render.targets.chessboard import Chessboard


@functools.lru_cache(maxsize=4)
def bare_scene(target: Chessboard) -> DeviceScene:
    """The target's shapes and reflectance without any light, for rays that only ask what they hit."""
    mi = backend.load()
    return mi.load_dict({"type": "scene", "board": _board(target), "circle": _circle(target)})


@functools.lru_cache(maxsize=4)
def reference_scene(target: Chessboard, light: Light) -> DeviceScene:
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
            "board": _board(target),
            "circle": _circle(target),
            "lamp": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f(frame),
                "emitter": {"type": "area", "radiance": {"type": "uniform", "value": lamp_radiance}},
            },
            "surrounding": {"type": "constant", "radiance": {"type": "uniform", "value": ambient_radiance}},
        }
    )


def radiances(target: Chessboard, light: Light) -> tuple[float, float]:
    """Radiance of the lamp and of the surrounding that give the board's white at its centre radiance 1."""
    lamp, ambient = reference_irradiance(target, light)
    lamp_radiance = (1.0 - light.ambient_share) * np.pi / target.white / lamp
    return float(lamp_radiance), light.ambient_share / target.white / ambient


def _board(target: Chessboard) -> dict[str, Any]:
    mi = backend.load()
    x0, x1, y0, y1 = target.extent_mm
    transform = mi.ScalarTransform4f
    centre = [(x0 + x1) / 2.0, (y0 + y1) / 2.0, 0.0]
    # One texel per square with one ring of margin, clamped beyond: the texture's extent differs from the board's.
    square = target.square_mm
    width, height = (target.columns + 2) * square, (target.rows + 2) * square
    to_uv = transform().translate([(x0 + 2.0 * square) / width, (y0 + 2.0 * square) / height, 0.0])
    to_uv = to_uv @ transform().scale([(x1 - x0) / width, (y1 - y0) / height, 1.0])
    return {
        "type": "rectangle",
        "flip_normals": True,
        "to_world": transform().translate(centre) @ transform().scale([(x1 - x0) / 2.0, (y1 - y0) / 2.0, 1.0]),
        "bsdf": {
            "type": "diffuse",
            "reflectance": {
                "type": "bitmap",
                "bitmap": mi.Bitmap(target.reflectance()[..., None]),
                "raw": True,
                "filter_type": "nearest",
                "wrap_mode": "clamp",
                "to_uv": to_uv,
            },
        },
    }


def _circle(target: Chessboard) -> dict[str, Any]:
    transform = backend.load().ScalarTransform4f
    radius = target.circle_radius_mm
    return {
        "type": "disk",
        "flip_normals": True,
        "to_world": transform().translate(list(target.circle_centre)) @ transform().scale([radius, radius, 1.0]),
        "bsdf": {"type": "diffuse", "reflectance": {"type": "uniform", "value": target.circle}},
    }
