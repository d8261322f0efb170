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
from render.device import DeviceScene
from render.light import Light
from render.pathtraced.fisheye import sensor_dict
from render.pathtraced.scene import reference_scene
from render.region import Image, target_region
from render.targets.image_region import Region
from render.targets.kinds import AnyTarget

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
    target: AnyTarget,
    light: Light,
    camera: Camera,
    cam_from_obj: Pose,
    *,
    samples: int,
    region: Region | None = None,
) -> LinearImage:
    """Render one frame in linear light, float32, box filter, by closed forms: without random numbers.

    samples: cells of a pixel that edges cross, a square number. region: pixels to render, by default the target's.
    """
    region = target_region(target, camera, cam_from_obj) if region is None else region
    radiance = integrate_region(target, light, camera, cam_from_obj, region, samples)
    return LinearImage(radiance, region, light.background)


def render_reference(
    target: AnyTarget,
    light: Light,
    camera: Camera,
    cam_from_obj: Pose,
    *,
    samples: int,
    seed: int,
    region: Region | None = None,
) -> LinearImage:
    """The same frame by Mitsuba's direct light, with `samples` multijittered rays for every pixel.

    seed: of the rays, 32 bits.
    """
    region = target_region(target, camera, cam_from_obj) if region is None else region
    film = _path_traced(reference_scene(target, light), camera, cam_from_obj, region, samples, seed)
    behind = np.maximum(lens_coverage(camera)[region.pixels] - film[..., 1], 0.0)
    radiance = film[..., 0] + np.float32(light.background) * behind
    return LinearImage(radiance.astype(np.float32), region, light.background)


def _path_traced(
    scene: DeviceScene, camera: Camera, cam_from_obj: Pose, region: Region, samples: int, seed: int
) -> Image:
    """(height, width, 2) radiance and share of hits by Mitsuba, a band of rows at a time to bound the memory."""
    mi = backend.load()
    rows = max(1, REFERENCE_RAYS // (region.width * samples))
    bands: list[Image] = []
    for top in range(region.y, region.y + region.height, rows):
        band = Region(region.x, top, region.width, min(rows, region.y + region.height - top))
        sensor = mi.load_dict(sensor_dict(camera, cam_from_obj, band, samples))
        keyed = (seed + top) & 0xFFFFFFFF  # no two bands share their random numbers
        bands.append(np.array(mi.render(scene, sensor=sensor, spp=samples, seed=keyed)))
    return np.concatenate(bands)
