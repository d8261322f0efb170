"""Primary rays for chosen pixels, shaded by lookup.

Only the pixels that an edge crosses need many samples: shading is a smooth map without noise, so elsewhere four give
the pixel's mean. The subpixel positions of a pixel follow from its place in the picture and the frame's seed alone,
so that a region has the bits of the whole picture.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from render import backend

CHUNK = 1 << 24  # rays in flight: 64 MB for each float that a ray carries
Pixels = NDArray[np.uint32]


def trace(
    scene: Any, sensor: Any, pixels: Pixels, picture: tuple[int, int], samples: int, seed: int
) -> NDArray[np.float32]:
    """(n, 2) radiance and share of hits of (n,) pixels, the means over `samples` multijittered rays each.

    scene: from `lookup_scene`. sensor: over the whole picture. pixels: y * width + x. picture: width and height, px.
    samples: a square number.
    """
    per_chunk = max(1, CHUNK // samples)
    parts = [
        _trace_chunk(scene, sensor, pixels[i : i + per_chunk], picture, samples, seed)
        for i in range(0, len(pixels), per_chunk)
    ]
    return np.concatenate(parts) if parts else np.zeros((0, 2), np.float32)


def _trace_chunk(
    scene: Any, sensor: Any, pixels: Pixels, picture: tuple[int, int], samples: int, seed: int
) -> NDArray[np.float32]:
    mi, dr = backend.load(), backend.jit()
    index = dr.arange(mi.UInt32, len(pixels) * samples)
    pixel, sample = dr.gather(mi.UInt32, mi.UInt32(pixels), index // samples), index % samples
    width, height = dr.opaque(mi.UInt32, picture[0]), dr.opaque(mi.UInt32, picture[1])
    inner = _multijitter(dr, mi, pixel, sample, round(samples**0.5), dr.opaque(mi.UInt32, seed & 0xFFFFFFFF))
    corner = mi.Point2f(mi.Float(pixel % width), mi.Float(pixel // width))
    position = (corner + inner) / mi.Point2f(mi.Float(width), mi.Float(height))
    ray, _ = sensor.sample_ray(mi.Float(0.0), mi.Float(0.0), position, mi.Point2f(0.0))
    radiance, hit = _shade(dr, mi, scene, ray)
    # Sums over the contiguous block of a pixel's samples: no atomic additions, the same bits every time.
    sums = [np.array(dr.block_sum(value, samples)) for value in (radiance, dr.select(hit, 1.0, 0.0))]
    return (np.stack(sums, axis=1) / samples).astype(np.float32)


def _shade(dr: Any, mi: Any, scene: Any, ray: Any) -> tuple[Any, Any]:
    """Reflectance times shading of what a ray hits first, and whether it hits; a back side is black."""
    si = scene.ray_intersect(ray, mi.RayFlags.Minimal | mi.RayFlags.UV | mi.RayFlags.ShadingFrame, True)
    hit = si.is_valid()
    reflectance = si.bsdf().eval_diffuse_reflectance(si, hit)
    shading = si.shape.eval_attribute_1("shading", si, hit)
    return dr.select(hit & (si.wi.z > 0.0), reflectance[0] * shading, 0.0), hit


def _multijitter(dr: Any, mi: Any, pixel: Any, sample: Any, side: int, seed: Any) -> Any:
    """Positions in [0, 1)^2: one sample in each cell of a side x side grid and in each of side^2 rows and columns.

    Source:
        Kensler 2013, Correlated multi-jittered sampling (Pixar technical memo 13-01).
    """
    key, other = mi.sample_tea_32(pixel, seed)
    jitter_key, _ = mi.sample_tea_32(key, sample)
    column, row = sample % side, sample // side
    shuffled_row = mi.permute_kensler(row, side, key)
    shuffled_column = mi.permute_kensler(column, side, other)
    jitter_x = mi.sample_tea_float32(jitter_key, 0)
    jitter_y = mi.sample_tea_float32(jitter_key, 1)
    x = (mi.Float(column) + (mi.Float(shuffled_row) + jitter_x) / side) / side
    y = (mi.Float(row) + (mi.Float(shuffled_column) + jitter_y) / side) / side
    return mi.Point2f(x, y)
