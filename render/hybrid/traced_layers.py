"""What rays through pixels see: the shiny layer of the board, what stands behind the target, and everything."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any  # Any: Mitsuba's objects, whose types depend on its variant

import numpy as np
from numpy.typing import NDArray

from render import backend
from render.device import DeviceBool, DeviceFloat, DeviceScene, DeviceSpectrum
from render.hybrid.outgoing import NUMBERS, direct_light, rest_of_light
from render.hybrid.pixel_rays import PixelRays, Pixels, RayCamera
from render.hybrid.placement import Placement

TARGET_SURFACES = 2  # that a ray may pass: the raised circle and the board
INSET_MM = 1e-3  # from the board's border, for points that are moved onto it
HIDDEN_WEIGHT = 1e-4  # of rays that the target stops, beside those that pass it
RELATIVE_DEPTH = 1e-4  # by which an object must be nearer than the target to be in front of it

Key = tuple[int, int]  # rays for a pixel, and seed

Radiance = NDArray[np.float32]  # (n, 3)


@dataclass(frozen=True, slots=True)
class TracedScene:
    """A Mitsuba scene with the target in it."""

    scene: DeviceScene
    target: DeviceScene  # the target alone, in the object frame
    placement: Placement  # of the object frame in the scene
    path: Any  # integrator for rays of the camera
    path_beyond: Any  # integrator for rays that leave a surface; it sees all light sources
    escaped: float  # radiance of what rays of the camera meet that leave the scene, beside the scene's own

    def everything(self, rays: RayCamera, pixels: Pixels, samples: int, seed: int) -> Radiance:
        """Mean radiance of pixels, by plain path tracing."""

        def radiance(found: PixelRays) -> tuple[DeviceSpectrum, DeviceFloat]:
            mi, dr = backend.load(), backend.jit()
            light = self._along(mi.Ray3f(found.origin, found.direction), found)
            return light, dr.select(found.seen, 1.0, 0.0)

        return rays.mean_over_pixels(pixels, samples, seed, radiance)[0]

    def behind(self, rays: RayCamera, pixels: Pixels, samples: int, seed: int) -> Radiance:
        """Mean radiance of what pixels see beside the target; where no ray passes it, of what stands behind it."""

        def radiance(found: PixelRays) -> tuple[DeviceSpectrum, DeviceFloat]:
            dr = backend.jit()
            ray, missed = self._past_target(found)
            weight = dr.select(found.seen, dr.select(missed, 1.0, HIDDEN_WEIGHT), 0.0)
            return self._along(ray, found) * weight, weight

        total, weight = rays.mean_over_pixels(pixels, samples, seed, radiance)
        return _weighted(total, weight)

    def _along(self, ray: Any, rays: PixelRays) -> DeviceSpectrum:
        """Radiance along rays of the object frame; none where the lens does not see."""
        mi, dr = backend.load(), backend.jit()
        placed = mi.RayDifferential3f(self.placement.ray(ray))
        light, meets, _ = self.path.sample(self.scene, rays.sampler, placed, None, rays.seen)
        light += dr.select(meets, 0.0, dr.opaque(mi.Float, self.escaped))
        return dr.select(rays.seen, light, 0.0)

    def _past_target(self, rays: PixelRays) -> tuple[Any, DeviceBool]:
        """Rays that begin behind the target where they meet it, and whether they do not."""
        mi, dr = backend.load(), backend.jit()
        ray, missed = mi.Ray3f(rays.origin, rays.direction), mi.Bool(True)
        for _ in range(TARGET_SURFACES):
            hit = self.target.ray_intersect(ray)
            missed &= ~hit.is_valid()
            ray.o = dr.select(hit.is_valid(), hit.spawn_ray(rays.direction).o, ray.o)
        dr.eval(ray, missed)  # a kernel traces one scene on a GPU; the rays of a second one would be left out
        return ray, missed

    def blocked(self, rays: RayCamera, pixels: Pixels, samples: int, seed: int) -> NDArray[np.float32]:
        """(n,) share of pixels' rays that meet something in front of the target."""

        def radiance(found: PixelRays) -> tuple[DeviceSpectrum, DeviceFloat]:
            mi, dr = backend.load(), backend.jit()
            ray = mi.Ray3f(found.origin, found.direction)
            target = self.target.ray_intersect(ray)
            dr.eval(target)  # see `_past_target`
            first = self.scene.ray_intersect(self.placement.ray(ray))
            limit = target.t * self.placement.scale * (1.0 - RELATIVE_DEPTH)
            in_front = target.is_valid() & (first.t < limit) & found.seen
            return dr.zeros(mi.Spectrum, dr.width(in_front)), dr.select(in_front, 1.0, 0.0)

        return rays.mean_over_pixels(pixels, samples, seed, radiance)[1]

    def gloss(
        self, coat: Any, extent_mm: tuple[float, float, float, float], rays: RayCamera, pixels: Pixels, key: Key
    ) -> Radiance:
        """Mean radiance of the board's shiny layer, as if the board's plane filled the pixels.

        coat: BSDF of the board without its paint. extent_mm: of the board; rays beside it take its nearest point.
        """
        samples, seed = key
        inset = np.array(extent_mm) + INSET_MM * np.array([1.0, -1.0, 1.0, -1.0])

        def radiance(found: PixelRays) -> tuple[DeviceSpectrum, DeviceFloat]:
            mi, dr = backend.load(), backend.jit()
            left, right, top, bottom = (dr.opaque(mi.Float, value) for value in inset)
            length = -found.origin.z / found.direction.z
            x, y = found.origin.x + length * found.direction.x, found.origin.y + length * found.direction.y
            place = mi.Vector3f(dr.clip(x, left, right), dr.clip(y, top, bottom), 0.0)
            toward = dr.normalize(found.origin - place)
            surface = self.placement.surface(place, mi.Vector3f(0.0, 0.0, -1.0), toward)
            light = direct_light(self.scene, surface, coat, found.numbers)
            light += rest_of_light(self.scene, self.path_beyond, surface, coat, found.numbers, found.sampler)
            weight = dr.select(found.seen & (found.origin.z < 0.0), 1.0, 0.0)
            return light * weight, weight

        total, weight = rays.mean_over_pixels(pixels, samples, seed, radiance, NUMBERS)
        return _weighted(total, weight)


def _weighted(total: Radiance, weight: NDArray[np.float32]) -> Radiance:
    """Sums by the sums of their weights; zero where no ray counts."""
    return np.asarray(total / np.maximum(weight, np.float32(1e-12))[:, None], np.float32)
