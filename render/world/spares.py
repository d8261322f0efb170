"""Specks too small to be seen, so that all draws of a world have as many things of each kind.

Dr.Jit's kernels hold how many shapes, materials and textures of each kind a scene has: one thing more or less would
compile them anew in the middle of a dataset.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any  # Any: Mitsuba describes a shape by dictionaries of mixed values

import numpy as np

from eposit.arrays import Array
from render.targets.kinds import AnyTarget
from render.world.shapes import FRONT, MeshShape, Objects

SPARE = "spare_"  # begins the names of specks
SPECK = 1e-6  # their size, of what they stand for: of a metre a micrometre
BEHIND_MM = 4.0  # the target's centre, where they are


def specks(objects: Objects, target: AnyTarget) -> Objects:
    """Things made so small that no ray meets them."""
    return {f"{SPARE}{name}": _speck(thing, target.board_centre - BEHIND_MM * FRONT) for name, thing in objects.items()}


def chosen(objects: Objects, count: int, target: AnyTarget) -> Objects:
    """The first `count` things as they are, and the others as specks."""
    names = list(objects)
    first = {name: objects[name] for name in names[:count]}
    return first | specks({name: objects[name] for name in names[count:]}, target)


def is_spare(name: str) -> bool:
    """Whether an object of this name is a speck."""
    return name.startswith(SPARE)


def _speck(thing: Any, place: Array) -> Any:
    if isinstance(thing, MeshShape):
        vertices = place + SPECK * thing.mesh.vertices
        return replace(thing, mesh=replace(thing.mesh, vertices=vertices))
    matrix = np.array(thing["to_world"], float)
    matrix[:3] *= SPECK
    matrix[:3, 3] += place
    return thing | {"to_world": matrix}
