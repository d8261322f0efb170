"""Materials of a world: textures drawn from random numbers, and the surfaces of boards."""

from __future__ import annotations

from typing import Any  # Any: Mitsuba describes a material by dictionaries of mixed values

import numpy as np
from numpy.typing import NDArray

from render import backend

Material = dict[str, Any]
Texture = NDArray[np.float32]  # (rows, columns, 3) linear reflectance

SIDE = 256  # texels along a side of a texture
LARGEST_REFLECTANCE = 0.85
LAMINATE_INDEX = 1.5  # refractive index of a laminate; 1.49 (acrylic) is Mitsuba's for plastic


def diffuse(colour: tuple[float, float, float]) -> Material:
    """A matt material of one colour, linear RGB."""
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(colour)}}


def textured(texture: Texture, repeats: tuple[float, float] = (1.0, 1.0)) -> Material:
    """A matt material with a texture, repeated along both sides of a surface."""
    mi = backend.load()
    return {
        "type": "diffuse",
        "reflectance": {
            "type": "bitmap",
            "bitmap": mi.Bitmap(np.ascontiguousarray(texture)),
            "raw": True,
            "to_uv": mi.ScalarTransform4f().scale([*repeats, 1.0]),
        },
    }


def random_colour(rng: np.random.Generator, low: float = 0.08, high: float = 0.7) -> tuple[float, float, float]:
    """A colour between two reflectances, linear RGB."""
    red, green, blue = rng.uniform(low, high, 3)
    return float(red), float(green), float(blue)


def material_of(number: int, rng: np.random.Generator) -> Material:
    """Of five things three are matt, one plastic and one metal, in random colours."""
    colour, kind, roughness = random_colour(rng), number % 5, float(rng.uniform(0.08, 0.4))
    if kind < 3:
        return diffuse(colour)
    if kind == 3:
        return {
            "type": "roughplastic",
            "diffuse_reflectance": {"type": "rgb", "value": list(colour)},
            "alpha": roughness,
        }
    return {
        "type": "roughconductor",
        "material": "none",
        "alpha": roughness,
        "specular_reflectance": {"type": "rgb", "value": [0.4 + 0.5 * c for c in colour]},
    }


def surface(kind: str, roughness: float, reflectance: Material) -> Material:
    """The front of a board. kind: of `World.surface`. reflectance: Mitsuba texture.

    Both coats are linear in the reflectance: light that is reflected inside the coat changes no colours.
    """
    if kind == "matt":
        return {"type": "diffuse", "reflectance": reflectance}
    if kind == "rough_plastic":
        return {"type": "roughplastic", "diffuse_reflectance": reflectance, "alpha": roughness, "nonlinear": False}
    return {"type": "plastic", "diffuse_reflectance": reflectance, "int_ior": LAMINATE_INDEX, "nonlinear": False}


def bricks(rng: np.random.Generator) -> Texture:
    """Courses of bricks, each a little different, with mortar between."""
    rows, columns, mortar = 8, 4, 3
    height, width = SIDE // rows, SIDE // columns
    base = np.array([0.42, 0.24, 0.17]) * rng.uniform(0.8, 1.3)
    texture = np.empty((SIDE, SIDE, 3))
    for row in range(rows):
        shades = rng.uniform(0.65, 1.35, (columns, 1)) * base
        course = np.repeat(shades, width, axis=0)
        joints = np.arange(SIDE) % width < mortar
        course[joints] = 0.42
        course = np.roll(course, (row % 2) * width // 2, axis=0)
        texture[row * height : (row + 1) * height] = course
        texture[row * height : row * height + mortar] = 0.42
    return _reflectance(texture * grain(rng, 0.12)[..., None])


def planks(rng: np.random.Generator) -> Texture:
    """Boards of wood along the rows."""
    count, joint = 8, 1
    width = SIDE // count
    base = np.array([0.36, 0.22, 0.12]) * rng.uniform(0.7, 1.4)
    texture = np.empty((SIDE, SIDE, 3))
    fibres = np.repeat(rng.normal(1.0, 0.07, (SIDE, SIDE // 16)), 16, axis=1)
    for i in range(count):
        texture[i * width : (i + 1) * width] = base * rng.uniform(0.7, 1.3)
        texture[i * width : i * width + joint] = 0.05
    return _reflectance(texture * fibres[..., None])


def tiles(rng: np.random.Generator) -> Texture:
    """Square tiles in two shades with joints."""
    count, joint = 4, 2
    width = SIDE // count
    light = np.array(random_colour(rng, 0.35, 0.6))
    y, x = np.mgrid[0:SIDE, 0:SIDE]
    odd = (x // width + y // width) % 2 == 1
    texture = np.where(odd[..., None], light, 0.6 * light)
    texture[(x % width < joint) | (y % width < joint)] = 0.2
    return _reflectance(texture * grain(rng, 0.05)[..., None])


def plaster(rng: np.random.Generator) -> Texture:
    """A painted wall, nearly even."""
    return _reflectance(np.array(random_colour(rng, 0.45, 0.7)) * grain(rng, 0.06)[..., None])


def asphalt(rng: np.random.Generator) -> Texture:
    """A grey, grainy ground."""
    return _reflectance(np.full(3, rng.uniform(0.12, 0.25)) * grain(rng, 0.3)[..., None])


def picture(rng: np.random.Generator) -> Texture:
    """A poster: random rectangles of colour."""
    texture = np.full((SIDE, SIDE, 3), random_colour(rng))
    for _ in range(12):
        x, y = rng.integers(0, SIDE - 16, 2)
        width, height = rng.integers(16, SIDE // 2, 2)
        texture[y : y + height, x : x + width] = random_colour(rng)
    return _reflectance(texture)


def grain(rng: np.random.Generator, deviation: float) -> NDArray[np.float64]:
    """(SIDE, SIDE) factors about 1: noise of three sizes."""
    total = np.zeros((SIDE, SIDE))
    for size in (1, 4, 32):
        total += np.kron(rng.normal(0.0, 1.0, (SIDE // size, SIDE // size)), np.ones((size, size)))
    return 1.0 + deviation / 3.0**0.5 * total


def _reflectance(texture: NDArray[np.float64]) -> Texture:
    return np.clip(texture, 0.01, LARGEST_REFLECTANCE).astype(np.float32)
