"""Things around and in front of the target: clutter, occluders, other chessboards.

What kind a thing is follows from its number, not from random numbers: Dr.Jit compiles a kernel for each set of kinds.
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from eposit.pose import rotation_from_vector
from render.targets.kinds import AnyTarget
from render.world.boards import other_board
from render.world.materials import material_of
from render.world.shapes import FRONT, RIGHT, UP, Objects, Shape, ball, box, pole

GAP_MM = 150.0  # between the target's border and what stands beside it
SIDE_MM = 1500.0  # width of the strip beside the target where things stand
BEFORE_MM = (120.0, 500.0)  # of occluders before the target
THIN_MM, THICK_MM = 8.0, 40.0  # radii of occluders
FIELD_OF_THINGS_MM = 900.0  # they lie so far before and behind the target's plane


def clutter(count: int, target: AnyTarget, rng: np.random.Generator) -> Objects:
    """Boxes, balls and rods of many materials, hanging around the target and never before it."""
    found: Objects = {}
    for i in range(count):
        size, at = rng.uniform(60.0, 400.0), _beside(target, rng)
        found[f"clutter_{i}"] = _thing(i, at, size, rng)
    return found


def occluders(count: int, target: AnyTarget, rng: np.random.Generator) -> Objects:
    """Poles and balls before the target: each hides a part of it from most places."""
    x0, x1, y0, y1 = target.extent_mm
    found: Objects = {}
    for i in range(count):
        before, radius = rng.uniform(*BEFORE_MM), rng.uniform(THIN_MM, THICK_MM)
        x, y = (rng.uniform(low + 0.2 * (high - low), high - 0.2 * (high - low)) for low, high in ((x0, x1), (y0, y1)))
        at = np.array([x, y, 0.0]) + before * FRONT
        if i % 2 == 0:
            tilt = rng.normal(0.0, 0.25)
            along = np.cos(tilt) * UP + np.sin(tilt) * RIGHT
            long = 0.7 * np.hypot(x1 - x0, y1 - y0)
            found[f"occluder_{i}"] = pole(at - long * along, at + long * along, radius, material_of(i, rng))
        else:
            found[f"occluder_{i}"] = ball(at, 2.0 * radius, material_of(i, rng))
    return found


def other_boards(count: int, target: AnyTarget, rng: np.random.Generator) -> Objects:
    """Chessboards of other sizes beside the target, turned towards the camera more or less."""
    found: Objects = {}
    for i in range(count):
        columns, rows = (int(n) for n in rng.integers(4, 11, 2))
        across, down = target.point_grid
        if (columns, rows) in ((across + 1, down + 1), (down + 1, across + 1)):
            columns += 1
        x0, x1, _, _ = target.extent_mm
        square = float(rng.uniform(0.4, 0.8)) * (x1 - x0) / (across + 3)  # of the paper's board a square's side
        matrix = np.eye(4)
        # z out of the board's front is -z of the object frame: half a turn about x, then a random lean.
        matrix[:3, :3] = rotation_from_vector(rng.normal(0.0, 0.35, 3)) @ np.diag([1.0, -1.0, -1.0])
        matrix[:3, 3] = _beside(target, rng)
        found[f"other_board_{i}"] = other_board(columns, rows, square, matrix)
    return found


def _beside(target: AnyTarget, rng: np.random.Generator) -> Array:
    """(3,) a place left of, right of, above or below the target, in a strip of SIDE_MM about its plane."""
    x0, x1, y0, y1 = target.extent_mm
    half = 0.5 * np.array([x1 - x0, y1 - y0]) + GAP_MM
    strip, side = rng.uniform(150.0, SIDE_MM), int(rng.integers(4))
    along = rng.uniform(-1.2, 1.2)
    offset = np.array([half[0] + strip, along * half[1]]) if side < 2 else np.array([along * half[0], half[1] + strip])
    sign = 1.0 if side % 2 == 0 else -1.0
    depth = rng.uniform(-0.3, 0.6) * FIELD_OF_THINGS_MM
    return target.board_centre + np.array([sign * offset[0], sign * offset[1], depth])


def _thing(number: int, at: Array, size: float, rng: np.random.Generator) -> Shape:
    """Of seven things four are boxes, two balls and one a rod."""
    kind, turn, material = number % 7, rng.uniform(0.0, np.pi), material_of(number, rng)
    if kind < 4:
        width, height, depth = rng.uniform(0.3, 1.0, 3) * size
        return box(at, (width, height, depth), turn, material)
    if kind < 6:
        return ball(at, 0.4 * size, material)
    direction = rng.normal(0.0, 1.0, 3)
    half = size * direction / np.linalg.norm(direction)
    return pole(at - half, at + half, 0.08 * size + 5.0, material)
