"""The floor of sampling: 64 primary rays for every pixel of the region, and nothing else; our render against it."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from datasets.plan import Frame
from datasets.recipe.model import Recipe
from pipelines.bench.cases import chosen_frames, linear_of
from pipelines.bench.table import Row, compared
from pipelines.timing import Times, in_turn, total
from render import backend
from render.pathtraced.fisheye import sensor_dict
from render.pathtraced.scene import bare_scene
from render.region import target_region

PART = "render"
RAYS = 64
NAME = f"{RAYS} primary rays for each pixel of the region"
IN_FLIGHT = 1 << 23


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """One row for each camera, and one for all of them together."""
    sums: list[list[Times]] = []
    for camera, frames in chosen_frames(recipe, poses).items():
        times = [
            in_turn(functools.partial(linear_of, recipe, frame), functools.partial(primary_rays, recipe, frame))
            for frame in frames
        ]
        own, floor = (total(list(column)) for column in zip(*times, strict=True))
        sums.append([own, floor])
        yield compared(PART, f"{camera}: render, {recipe.sample_count()} samples", own, NAME, floor, len(frames))
    own, floor = (total(list(column)) for column in zip(*sums, strict=True))
    yield compared(PART, "one render of each camera", own, NAME, floor, poses)


def primary_rays(recipe: Recipe, frame: Frame) -> NDArray[np.float32]:
    """(pixels,) summed reflectance that independent rays through our sensor meet in Mitsuba's scene; no light."""
    mi, dr = backend.load(), backend.jit()
    camera = frame.camera.true_camera()
    region = target_region(recipe.target, camera, frame.cam_from_obj)
    sensor = mi.load_dict(sensor_dict(camera, frame.cam_from_obj, region, RAYS))
    scene, (width, height) = bare_scene(recipe.target), region[2:]
    size = mi.Point2f(dr.opaque(mi.Float, width), dr.opaque(mi.Float, height))
    rows = max(1, IN_FLIGHT // (width * RAYS))
    sums: list[NDArray[np.float32]] = []
    for top in range(0, height, rows):
        count = width * min(rows, height - top) * RAYS
        pixel = dr.arange(mi.UInt32, count) // RAYS
        columns = dr.opaque(mi.UInt32, width)
        row = pixel // columns
        generator = mi.PCG32(size=count, initstate=dr.opaque(mi.UInt64, top))
        inner = mi.Point2f(generator.next_float32(), generator.next_float32())
        corner = mi.Point2f(mi.Float(pixel - row * columns), mi.Float(row + dr.opaque(mi.UInt32, top)))
        ray, _ = sensor.sample_ray(mi.Float(0.0), mi.Float(0.0), (corner + inner) / size, mi.Point2f(0.0))
        hit = scene.ray_intersect(ray, mi.RayFlags.Minimal | mi.RayFlags.UV | mi.RayFlags.ShadingFrame, mi.Bool(True))
        reflectance = hit.bsdf().eval_diffuse_reflectance(hit, hit.is_valid())[0]
        sums.append(np.array(dr.block_sum(dr.select(hit.is_valid(), reflectance, 0.0), RAYS)))
    return np.concatenate(sums)
