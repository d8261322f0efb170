"""Shapes of a world as Mitsuba descriptions whose `to_world` is a (4, 4) NumPy matrix in the object frame, mm.

`render.world.compose` turns the matrices into Mitsuba's and into the frame of the scene.
"""

from __future__ import annotations

from typing import Any  # Any: Mitsuba describes a shape by dictionaries of mixed values

import numpy as np

from eposit.arrays import Array

Shape = dict[str, Any]
Objects = dict[str, Any]  # name to shape or emitter
UP = np.array([0.0, -1.0, 0.0])  # of the world, in the object frame
FRONT = np.array([0.0, 0.0, -1.0])  # out of the board, towards the camera
RIGHT = np.array([1.0, 0.0, 0.0])


def frame_matrix(x: Array, y: Array, z: Array, origin: Array) -> Array:
    """(4, 4) matrix with three axes, which may be scaled, and an origin as columns."""
    matrix = np.eye(4)
    matrix[:3] = np.column_stack((x, y, z, origin))
    return matrix


def rectangle(centre: Array, half_x: Array, half_y: Array, bsdf: Shape) -> Shape:
    """A rectangle from its centre and two half sides, seen from half_x x half_y."""
    normal = np.cross(half_x, half_y)
    return {
        "type": "rectangle",
        "to_world": frame_matrix(half_x, half_y, normal / np.linalg.norm(normal), centre),
        "bsdf": bsdf,
    }


def box(centre: Array, size: tuple[float, float, float], turn_rad: float, bsdf: Shape) -> Shape:
    """A box that stands upright. size: width, height, depth. turn_rad: about the vertical."""
    right, front = turned(turn_rad)
    width, height, depth = (0.5 * side for side in size)
    return {"type": "cube", "to_world": frame_matrix(width * right, height * UP, depth * front, centre), "bsdf": bsdf}


def ball(centre: Array, radius: float, bsdf: Shape) -> Shape:
    """A sphere."""
    return {"type": "sphere", "to_world": frame_matrix(*(radius * np.eye(3)), centre), "bsdf": bsdf}


def pole(low: Array, high: Array, radius: float, bsdf: Shape) -> Shape:
    """A cylinder without caps between two points."""
    axis = high - low
    unit = axis / np.linalg.norm(axis)
    side = np.cross(unit, FRONT if abs(unit @ FRONT) < 0.9 else RIGHT)
    side /= np.linalg.norm(side)
    # Mitsuba's cylinder has radius 1 and reaches from 0 to 1 along z; its bounding box follows the matrix.
    return {
        "type": "cylinder",
        "to_world": frame_matrix(radius * side, radius * np.cross(unit, side), axis, low),
        "bsdf": {"type": "twosided", "inner": bsdf},
    }


def turned(turn_rad: float) -> tuple[Array, Array]:
    """Right and front after a turn about the vertical."""
    cosine, sine = np.cos(turn_rad), np.sin(turn_rad)
    return cosine * RIGHT + sine * FRONT, cosine * FRONT - sine * RIGHT
