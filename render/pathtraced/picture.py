"""A picture of a world by Mitsuba's path tracer."""

from __future__ import annotations

import functools

import numpy as np
from numpy.typing import NDArray

from render import backend
from render.colour import luminance
from render.light import Light
from render.pathtraced.tiles import Film, Tracer, Viewpoint, trace_region
from render.targets.image_region import Region
from render.targets.kinds import AnyTarget
from render.world import World, WorldDraw
from render.world.compose import WHOLE, Parts, load_scene

CARD = Parts(has_card=True)
METER_POINTS, METER_RAYS = 32, 16  # points along each side of the card, rays from each
METER_SEED = 20
CARD_GAP_MM = 1.0  # between the card and where its rays begin


def trace_picture(
    world: World, draw: WorldDraw, target: AnyTarget, light: Light, view: Viewpoint, near: Region, region: Region
) -> Film:
    """(height, width, 4) linear RGB and share of hits of a region; 1 is a matt white board there, on the mean.

    near: where pixels get `path_samples`; tiles that do not touch it get `background_samples`.

    Raises:
        ValueError: no light reaches the target, or the user's scene cannot be used.
    """

    def samples(tile: Region) -> int:
        return world.path_samples if _overlap(tile, near) else world.background_samples

    tracer, gain = prepared(world, draw, target, light)
    film = trace_region(tracer, view, region, samples)
    film[..., :3] *= np.float32(gain)
    return film


@functools.lru_cache(maxsize=1)
def prepared(world: World, draw: WorldDraw, target: AnyTarget, light: Light) -> tuple[Tracer, float]:
    """A world's scene with its path tracer, and what its radiance is multiplied with.

    The scene before this one is freed first, and so is the one with the card: Dr.Jit numbers what is alive, and only
    where worlds of one kind are numbered alike a kernel serves them all.

    Raises:
        ValueError: no light reaches the target, or the user's scene cannot be used.
    """
    prepared.cache_clear()
    gain = metered_gain(world, draw, target, light)
    return tracer_of(world, draw, target, light), gain


def tracer_of(world: World, draw: WorldDraw, target: AnyTarget, light: Light, parts: Parts = WHOLE) -> Tracer:
    """A world's scene with its path tracer."""
    scene, composition = load_scene(world, draw, target, light, parts)
    kind = "volpath" if composition.has_medium else "path"
    settings = {"type": kind, "max_depth": world.path_depth, "hide_emitters": not composition.shows_emitters}
    return Tracer(scene, backend.load().load_dict(settings), composition)


def metered_gain(world: World, draw: WorldDraw, target: AnyTarget, light: Light) -> float:
    """What radiance in a world is multiplied with, so that 1 is a matt white card in the target's place, on the mean.

    The studio's light is stated on this scale already: 1.

    Raises:
        ValueError: no light reaches the target.
    """
    if world.surround == "studio":
        return 1.0
    mean = float(np.mean(luminance(_card_radiance(tracer_of(world, draw, target, light, CARD), target))))
    if not mean > 0.0:
        raise ValueError("no light reaches the target's front; turn it to the light or move it")
    return 1.0 / mean


def _card_radiance(tracer: Tracer, target: AnyTarget) -> NDArray[np.float32]:
    """(n, 3) radiance of points of the card, seen along its normal."""
    mi, dr = backend.load(), backend.jit()
    x0, x1, y0, y1 = target.extent_mm
    inner = (np.arange(METER_POINTS) + 0.5) / METER_POINTS
    x, y = (grid.ravel() for grid in np.meshgrid(x0 + (x1 - x0) * inner, y0 + (y1 - y0) * inner))
    points = (
        np.column_stack((x, y, np.full(x.size, -CARD_GAP_MM), np.ones(x.size))) @ tracer.composition.world_from_obj.T
    )
    inwards = tracer.composition.world_from_obj[:3, 2] / np.linalg.norm(tracer.composition.world_from_obj[:3, 2])
    origins = np.repeat(points[:, :3], METER_RAYS, axis=0)
    sampler = mi.load_dict({"type": "independent", "sample_count": 1})
    sampler.seed(METER_SEED, len(origins))
    ray = mi.Ray3f(mi.Point3f(*(backend.upload(part) for part in origins.T)), mi.Vector3f(*backend.opaque(*inwards)))
    with dr.suspend_grad():
        radiance, _, _ = tracer.integrator.sample(tracer.scene, sampler, mi.RayDifferential3f(ray))
        dr.eval(radiance)
    return np.array(radiance).T


def _overlap(a: Region, b: Region) -> bool:
    across = a.x < b.x + b.width and b.x < a.x + a.width
    return across and a.y < b.y + b.height and b.y < a.y + a.height
