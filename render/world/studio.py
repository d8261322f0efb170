"""The studio: the recipe's lamp and even surrounding, both unseen by the camera, and nothing else."""

from __future__ import annotations

import numpy as np

from render.light import Light, reference_irradiance
from render.targets.chessboard import Chessboard
from render.world.shapes import Objects, frame_matrix


def studio(target: Chessboard, light: Light) -> Objects:
    """The lamp and the surrounding that give the board's white at its centre radiance 1."""
    corners = light.lamp_corners(target)
    edge_a, edge_b = (corners[1] - corners[0]) / 2.0, (corners[3] - corners[0]) / 2.0
    to_board = target.board_centre - corners.mean(axis=0)
    facing = 1.0 if np.cross(edge_a, edge_b) @ to_board > 0.0 else -1.0
    matrix = frame_matrix(edge_a, facing * edge_b, facing * np.cross(edge_a, edge_b), corners.mean(axis=0))
    lamp_radiance, ambient_radiance = radiances(target, light)
    return {
        "lamp": {
            "type": "rectangle",
            "to_world": matrix,
            "emitter": {"type": "area", "radiance": {"type": "uniform", "value": lamp_radiance}},
        },
        "surrounding": {"type": "constant", "radiance": {"type": "uniform", "value": ambient_radiance}},
    }


def radiances(target: Chessboard, light: Light) -> tuple[float, float]:
    """Radiance of the lamp and of the surrounding that give the board's white at its centre radiance 1."""
    lamp, ambient = reference_irradiance(target, light)
    lamp_radiance = (1.0 - light.ambient_share) * np.pi / target.white / lamp
    return float(lamp_radiance), light.ambient_share / target.white / ambient
