"""A furnished room from random numbers: the target hangs near the back wall, lamps under the ceiling."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from render.targets.chessboard import Chessboard
from render.world.description import World
from render.world.draw import WorldDraw
from render.world.materials import Material, bricks, diffuse, picture, planks, plaster, random_colour, textured, tiles
from render.world.shapes import FRONT, RIGHT, UP, Objects, box, pole, rectangle

WALL_DISTANCE_MM = 700.0  # between the target and the wall behind it
TEXTURE_MM = 2000.0  # side of a texture on a wall or floor
LAMP_RADIANCE = 12.0  # W / (m^2 sr); pictures are metered, so that only ratios count
LAMP_ROWS, LAMP_COLUMNS = 2, 2
LAMP_SIZE_MM = (1400.0, 350.0)
LAMP_GAP_MM = 40.0  # between a lamp and the ceiling


def room(world: World, draw: WorldDraw, target: Chessboard, rng: np.random.Generator) -> Objects:
    """Walls, floor, ceiling, lamps, furniture and pictures. Its middle lies in front of the target."""
    width, height, depth = world.room_mm
    floor = target.board_centre - world.floor_mm * UP
    middle = floor + (0.5 * depth - WALL_DISTANCE_MM) * FRONT
    return {
        **_shell(middle, (width, height, depth), rng),
        **_lamps(middle, (width, height, depth), draw, rng),
        **_furniture(middle, (width, height, depth), rng),
        **_pictures(middle, (width, height, depth), rng),
    }


def contains(world: World, target: Chessboard, point: Array) -> bool:
    """Whether a point of the object frame, mm, lies inside the room."""
    width, height, depth = world.room_mm
    from_floor = point - (target.board_centre - world.floor_mm * UP)
    across, up, front = (float(from_floor @ axis) for axis in (RIGHT, UP, FRONT))
    return abs(across) < 0.5 * width and 0.0 < up < height and -WALL_DISTANCE_MM < front < depth - WALL_DISTANCE_MM


def _shell(middle: Array, size: tuple[float, float, float], rng: np.random.Generator) -> Objects:
    """Two walls of brick, two of plaster, a floor of wood or tiles, a white ceiling; all seen from inside."""
    width, height, depth = size
    brick, paint = bricks(rng), plaster(rng)
    floor_texture = planks(rng) if rng.random() < 0.5 else tiles(rng)
    half_up = 0.5 * height * UP
    centre = middle + half_up

    def covered(texture: np.ndarray, across: float, along: float) -> Material:
        return textured(texture, (across / TEXTURE_MM, along / TEXTURE_MM))

    return {
        "wall_back": rectangle(
            centre - 0.5 * depth * FRONT, 0.5 * width * RIGHT, half_up, covered(brick, width, height)
        ),
        "wall_front": rectangle(
            centre + 0.5 * depth * FRONT, -0.5 * width * RIGHT, half_up, covered(paint, width, height)
        ),
        "wall_left": rectangle(
            centre - 0.5 * width * RIGHT, -0.5 * depth * FRONT, half_up, covered(paint, depth, height)
        ),
        "wall_right": rectangle(
            centre + 0.5 * width * RIGHT, 0.5 * depth * FRONT, half_up, covered(brick, depth, height)
        ),
        "floor": rectangle(middle, 0.5 * width * RIGHT, -0.5 * depth * FRONT, covered(floor_texture, width, depth)),
        "ceiling": rectangle(
            middle + 2.0 * half_up, 0.5 * width * RIGHT, 0.5 * depth * FRONT, diffuse((0.75, 0.75, 0.73))
        ),
    }


def _lamps(middle: Array, size: tuple[float, float, float], draw: WorldDraw, rng: np.random.Generator) -> Objects:
    """Flat lamps that shine down, each of its own warmth."""
    width, height, depth = size
    lamps: Objects = {}
    for i in range(LAMP_ROWS * LAMP_COLUMNS):
        row, column = divmod(i, LAMP_COLUMNS)
        angle, warmth = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(0.0, 1.0)
        power = 1.0 + (draw.lamp_power - 1.0) * (1.0 if i % 2 == 0 else 0.5)  # so that the ratio of lamps varies, too
        across = ((column + 0.5) / LAMP_COLUMNS - 0.5) * width * 0.8 + draw.lamp_shift_mm * np.cos(angle)
        along = ((row + 0.5) / LAMP_ROWS - 0.5) * depth * 0.7 + draw.lamp_shift_mm * np.sin(angle)
        colour = LAMP_RADIANCE * max(power, 0.0) * np.array([1.0, 0.95 - 0.1 * warmth, 0.9 - 0.35 * warmth])
        centre = middle + (height - LAMP_GAP_MM) * UP + across * RIGHT + along * FRONT
        half_x, half_y = 0.5 * LAMP_SIZE_MM[0] * RIGHT, 0.5 * LAMP_SIZE_MM[1] * FRONT
        lamp = rectangle(centre, half_x, half_y, diffuse((0.5, 0.5, 0.5)))
        lamp["emitter"] = {"type": "area", "radiance": {"type": "rgb", "value": colour.tolist()}}
        lamps[f"lamp_{i}"] = lamp
    return lamps


def _furniture(middle: Array, size: tuple[float, float, float], rng: np.random.Generator) -> Objects:
    """A table, a shelf and a cupboard along the walls."""
    width, _, depth = size
    wood = diffuse(random_colour(rng, 0.15, 0.45))
    side = 1.0 if rng.random() < 0.5 else -1.0
    table = middle + side * (0.5 * width - 900.0) * RIGHT + rng.uniform(-0.2, 0.1) * depth * FRONT
    found: Objects = {"table_top": box(table + 740.0 * UP, (1400.0, 40.0, 700.0), 0.0, wood)}
    for i, (a, b) in enumerate(((-1, -1), (1, -1), (-1, 1), (1, 1))):
        foot = table + a * 640.0 * RIGHT + b * 290.0 * FRONT
        found[f"table_leg_{i}"] = pole(foot, foot + 720.0 * UP, 25.0, diffuse((0.2, 0.2, 0.2)))
    shelf = middle - side * (0.5 * width - 700.0) * RIGHT - (0.5 * depth - 250.0) * FRONT
    for i in range(4):
        found[f"shelf_{i}"] = box(shelf + (350.0 + 420.0 * i) * UP, (1100.0, 25.0, 350.0), 0.0, wood)
        for j in range(5):
            tall = rng.uniform(150.0, 330.0)
            book = shelf + (363.0 + 420.0 * i + 0.5 * tall) * UP + (-440.0 + 190.0 * j) * RIGHT
            found[f"book_{i}_{j}"] = box(
                book, (rng.uniform(40.0, 150.0), tall, 220.0), 0.0, diffuse(random_colour(rng))
            )
    cupboard = middle + side * (0.5 * width - 350.0) * RIGHT - (0.5 * depth - 700.0) * FRONT
    found["cupboard"] = box(cupboard + 950.0 * UP, (600.0, 1900.0, 900.0), 0.0, diffuse(random_colour(rng, 0.2, 0.6)))
    return found


def _pictures(middle: Array, size: tuple[float, float, float], rng: np.random.Generator) -> Objects:
    """Posters on the back wall beside the target."""
    width, _, depth = size
    found: Objects = {}
    for i, side in enumerate((-1.0, 1.0)):
        across = side * rng.uniform(0.26, 0.38) * width
        centre = middle - (0.5 * depth - 15.0) * FRONT + across * RIGHT + rng.uniform(1900.0, 3600.0) * UP
        half = rng.uniform(250.0, 550.0), rng.uniform(300.0, 600.0)
        found[f"picture_{i}"] = rectangle(centre, half[0] * RIGHT, half[1] * UP, textured(picture(rng)))
    return found
