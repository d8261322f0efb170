"""Outdoors: sun and sky over a wide ground with buildings far away, or an environment map of the user's."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from render.targets.kinds import AnyTarget
from render.world.description import World
from render.world.draw import WorldDraw
from render.world.materials import asphalt, diffuse, random_colour, textured
from render.world.shapes import FRONT, RIGHT, UP, Objects, ball, box, frame_matrix, pole, rectangle

GROUND_MM = 2e6  # side of the ground: 2 km, where a camera 1 m high sees the horizon 0.06 degrees too low
TEXTURE_MM = 4000.0
BUILDINGS, TREES = 14, 10
NEAREST_MM, FARTHEST_MM = 25e3, 120e3  # of buildings


def sky(world: World, draw: WorldDraw, target: AnyTarget, rng: np.random.Generator) -> Objects:
    """Sun and sky, ground, buildings and trees."""
    floor = target.board_centre - world.floor_mm * UP
    repeats = GROUND_MM / TEXTURE_MM
    half = 0.5 * GROUND_MM
    return {
        "sky": {
            "type": "sunsky",
            "sun_direction": sun_direction(draw).tolist(),
            "turbidity": world.turbidity,
            "to_world": frame_matrix(RIGHT, -FRONT, UP, np.zeros(3)),
        },
        "ground": rectangle(floor, half * RIGHT, -half * FRONT, textured(asphalt(rng), (repeats, repeats))),
        **_buildings(floor, rng),
        **_trees(floor, rng),
    }


def environment(world: World, draw: WorldDraw) -> Objects:
    """The user's environment map, whose upright axis is y, turned about it."""
    turn = np.deg2rad(draw.rotation_deg)
    right = np.cos(turn) * RIGHT + np.sin(turn) * FRONT
    front = np.cos(turn) * FRONT - np.sin(turn) * RIGHT
    return {
        "environment": {
            "type": "envmap",
            "filename": world.file,
            "to_world": frame_matrix(right, UP, front, np.zeros(3)),
        }
    }


def sun_direction(draw: WorldDraw) -> Array:
    """(3,) unit vector to the sun in the object frame, which is what Mitsuba takes it in, whatever the sky's own is."""
    elevation, turn = np.deg2rad(draw.sun_elevation_deg), np.deg2rad(draw.rotation_deg)
    return np.cos(elevation) * (np.sin(turn) * RIGHT + np.cos(turn) * FRONT) + np.sin(elevation) * UP


def _around(rng: np.random.Generator, nearest: float, farthest: float) -> Array:
    angle, distance = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(nearest, farthest)
    return distance * (np.cos(angle) * RIGHT + np.sin(angle) * FRONT)


def _buildings(floor: Array, rng: np.random.Generator) -> Objects:
    found: Objects = {}
    for i in range(BUILDINGS):
        width, height, depth = rng.uniform((6e3, 4e3, 6e3), (25e3, 18e3, 15e3))
        centre = floor + _around(rng, NEAREST_MM, FARTHEST_MM) + 0.5 * height * UP
        walls = diffuse(random_colour(rng, 0.2, 0.6))
        found[f"building_{i}"] = box(centre, (width, height, depth), rng.uniform(0.0, np.pi), walls)
    return found


def _trees(floor: Array, rng: np.random.Generator) -> Objects:
    found: Objects = {}
    for i in range(TREES):
        foot = floor + _around(rng, 9e3, 40e3)
        height, crown = rng.uniform(3e3, 7e3), rng.uniform(1200.0, 2500.0)
        leaves = diffuse((0.06, float(rng.uniform(0.12, 0.25)), 0.04))
        found[f"trunk_{i}"] = pole(foot, foot + height * UP, 160.0, diffuse((0.16, 0.1, 0.07)))
        found[f"crown_{i}"] = ball(foot + height * UP, crown, leaves)
    return found
