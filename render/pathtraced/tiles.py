"""Pictures by Mitsuba's path tracer, tile by tile.

Tiles are aligned with the picture and have the seeds of their places, so that a region has the bits of the whole
picture. All tiles have a film of one size without a crop, and the principal point is shifted instead: a new crop would
compile the kernel anew.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any  # Any: Mitsuba's integrators and scenes have no common type in its stubs

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from render import backend
from render.optics import Optics
from render.pathtraced.fisheye import tile_sensor
from render.targets.image_region import Region
from render.world.compose import Composition

PINHOLE = Optics()
TILE = 128  # px along a side
Film = NDArray[np.float32]  # (height, width, 4) linear RGB and share of hits


@dataclass(frozen=True, slots=True)
class Tracer:
    """A loaded scene with the path tracer that renders it."""

    scene: Any
    integrator: Any
    composition: Composition


@dataclass(frozen=True, slots=True)
class Viewpoint:
    """From where a frame is seen, by which lens, and the seed of its rays."""

    camera: Camera
    cam_from_obj: Pose
    seed: int  # 32 bits
    optics: Optics = PINHOLE


def trace_region(tracer: Tracer, view: Viewpoint, region: Region, samples: Callable[[Region], int]) -> Film:
    """The film of a region of the picture.

    samples: rays for a pixel of a tile; the sampler may round up.
    """
    film = np.zeros((region.height, region.width, 4), np.float32)
    for tile in tiles_of(region):
        part = trace_tile(tracer, view, tile, samples(tile))
        rows = slice(max(tile.y, region.y), min(tile.y + TILE, region.y + region.height))
        columns = slice(max(tile.x, region.x), min(tile.x + TILE, region.x + region.width))
        film[_shifted(rows, region.y), _shifted(columns, region.x)] = part[
            _shifted(rows, tile.y), _shifted(columns, tile.x)
        ]
    return film


def tiles_of(region: Region) -> Iterator[Region]:
    """The tiles that a region touches, row by row; those at the picture's border reach beyond it."""
    for y in range(region.y // TILE, -(-(region.y + region.height) // TILE)):
        for x in range(region.x // TILE, -(-(region.x + region.width) // TILE)):
            yield Region(x * TILE, y * TILE, TILE, TILE)


def trace_tile(tracer: Tracer, view: Viewpoint, tile: Region, samples: int) -> Film:
    """(TILE, TILE, 4) film of one tile."""
    dr = backend.jit()
    place = tile, samples, tracer.composition.world_from_obj
    sensor = tile_sensor(view.camera, view.cam_from_obj, *place, view.optics.pupil)
    with dr.suspend_grad():
        film = tracer.integrator.render(tracer.scene, sensor, seed=tile_seed(view.seed, tile), spp=0)
    return np.array(film)


def tile_seed(seed: int, tile: Region) -> int:
    """32 bits for one tile of a frame."""
    return int(np.random.SeedSequence((seed, tile.x // TILE, tile.y // TILE)).generate_state(1)[0])


def _shifted(part: slice, origin: int) -> slice:
    return slice(part.start - origin, part.stop - origin)
