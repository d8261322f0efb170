"""Rays through pixels of a picture, each with its own random numbers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any  # Any: Mitsuba's objects, whose types depend on its variant

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from render import backend
from render.analytic.rays import DeviceCamera, device_camera
from render.device import DeviceBool, DeviceFloat, DeviceSpectrum, DeviceVector3
from render.hybrid.keyed_sampler import keyed_sampler, lattice_numbers

MAX_RAYS = 1 << 21  # in flight

Pixels = NDArray[np.uint32]  # (n,) numbers of pixels, counted row by row over the whole picture


@dataclass(frozen=True, slots=True)
class PixelRays:
    """Rays in flight."""

    origin: DeviceVector3  # camera's centre, mm, object frame
    direction: DeviceVector3  # of unit length
    seen: DeviceBool  # whether they pass inside the lens's image circle
    numbers: list[DeviceFloat]  # evenly spread random numbers, as many as were asked for
    sampler: Any  # for all further ones


@dataclass(frozen=True, slots=True)
class RayCamera:
    """A camera at a pose that sends rays through chosen pixels."""

    camera: Camera
    cam_from_obj: Pose

    def mean_over_pixels(
        self,
        pixels: Pixels,
        samples: int,
        seed: int,
        radiance: Callable[[PixelRays], tuple[DeviceSpectrum, DeviceFloat]],
        numbers: int = 0,
    ) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """(n, 3) sums of radiance over each pixel's rays by their number, and (n,) the same for the rays' weights.

        radiance: of rays, and their weights. seed: 32 bits; a pixel's value depends on it and on the pixel alone.
        numbers: evenly spread random numbers that `radiance` takes.
        """
        device = device_camera(self.camera, self.cam_from_obj)
        means, weights = [np.zeros((0, 3), np.float32)], [np.zeros(0, np.float32)]
        for part in _parts(pixels, max(1, MAX_RAYS // samples)):
            value, weight = radiance(self._rays(device, part, samples, seed, numbers))
            backend.jit().eval(value, weight)  # at once: each channel by itself would trace all rays again
            means.append(np.stack([_mean(channel, samples) for channel in value], axis=1))
            weights.append(_mean(weight, samples))
        return np.concatenate(means), np.concatenate(weights)

    def _rays(self, device: DeviceCamera, pixels: Pixels, samples: int, seed: int, numbers: int) -> PixelRays:
        mi, dr = backend.load(), backend.jit()
        lane = dr.arange(mi.UInt32, len(pixels) * samples)
        place = lane // samples
        ray, pixel = lane - place * samples, dr.gather(mi.UInt32, backend.upload(pixels), place)
        key = dr.opaque(mi.UInt32, seed)
        spread = lattice_numbers(pixel, ray, key, 2 + numbers)
        width = dr.opaque(mi.UInt32, self.camera.width)
        row = pixel // width
        x, y = mi.Float(pixel - row * width) + spread[0] - 0.5, mi.Float(row) + spread[1] - 0.5
        rays = device.rays(x, y)
        origin = mi.Vector3f(*rays.origin) + dr.zeros(mi.Vector3f, len(pixels) * samples)
        found = PixelRays(origin, dr.normalize(rays.direction), rays.seen, spread[2:], keyed_sampler(pixel, ray, key))
        # A kernel of its own, so that the large ones that trace the rays are compiled once for all lenses.
        dr.eval(found.origin, found.direction, found.seen, pixel, ray)
        return found


def _mean(values: DeviceFloat, samples: int) -> NDArray[np.float32]:
    dr = backend.jit()
    return np.array(dr.block_sum(values, samples), np.float32) / np.float32(samples)


def _parts(pixels: Pixels, size: int) -> Iterator[Pixels]:
    for first in range(0, len(pixels), size):
        yield pixels[first : first + size]
