"""One frame in linear light: rendered in the region that the target can touch, computed everywhere else.

Radiance 1 is the white board at its centre. Outside the region only background and the lens's image circle remain,
and those need no rays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eposit import Camera, Pose
from render import backend
from render.analytic.image_circle import lens_coverage
from render.analytic.integrate import integrate_region
from render.light import Light
from render.pathtraced.fisheye import sensor_dict
from render.pathtraced.scene import reference_scene
from render.region import Image, target_region
from render.targets.chessboard import Chessboard
from render.targets.image_region import Region

REFERENCE_RAYS = 1 << 24  # in flight while the reference is traced


@dataclass(frozen=True, slots=True)
class LinearImage:
    """Linear radiance of a region and of the rest."""

    radiance: Image  # (height, width) of the region
    region: Region
    background: float  # radiance behind the board

    def full(self, camera: Camera) -> Image:
        """(camera.height, camera.width) radiance of the whole picture."""
        picture = (self.background * lens_coverage(camera)).astype(np.float32)
        picture[self.region.pixels] = self.radiance
        return picture


def render_frame(
    target: Chessboard,
    light: Light,
    camera: Camera,
    cam_from_obj: Pose,
    *,
    samples: int,
    seed: int = 0,
    region: Region | None = None,
    reference: bool = False,
) -> LinearImage:
    """Render one frame in linear light, float32, box filter.

    samples: cells of a pixel that edges cross, a square number. region: pixels to render, by default the target's.
    reference: Mitsuba's direct light, path traced with `samples` multijittered rays for every pixel, instead of ours.
    seed: of the reference's rays, 32 bits; ours has no random numbers.
    """
    region = target_region(target, camera, cam_from_obj) if region is None else region
    if not reference:
        radiance = integrate_region(target, light, camera, cam_from_obj, region, samples)
        return LinearImage(radiance, region, light.background)
    film = _reference(target, light, camera, cam_from_obj, region, samples, seed)
    behind = np.maximum(lens_coverage(camera)[region.pixels] - film[..., 1], 0.0)
    radiance = film[..., 0] + np.float32(light.background) * behind
    return LinearImage(radiance.astype(np.float32), region, light.background)


def _reference(
    target: Chessboard, light: Light, camera: Camera, cam_from_obj: Pose, region: Region, samples: int, seed: int
) -> Image:
    """(height, width, 2) radiance and share of hits by Mitsuba, a band of rows at a time to bound the memory."""
    mi = backend.load()
    x, y, width, height = region
    rows = max(1, REFERENCE_RAYS // (width * samples))
    bands: list[Image] = []
    for top in range(y, y + height, rows):
        band = Region(x, top, width, min(rows, y + height - top))
        sensor = mi.load_dict(sensor_dict(camera, cam_from_obj, band, samples))
        keyed = (seed + top) & 0xFFFFFFFF  # no two bands share their random numbers
        bands.append(np.array(mi.render(reference_scene(target, light), sensor=sensor, spp=samples, seed=keyed)))
    return np.concatenate(bands)
