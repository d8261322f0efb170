"""Random numbers for rays that depend on the ray's key alone: never on how many rays are in flight, nor on their order.

Mitsuba's samplers count a ray by its place in the wavefront. A pixel's bits would then depend on which other pixels are
rendered with it. Here each ray brings its pixel and its number in the pixel.
"""

from __future__ import annotations

import functools
from typing import Any  # Any: Mitsuba has no class to derive from before its variant is set

from render import backend
from render.device import DeviceIndex

LATTICE_BITS = 24  # of a float32's mantissa
TEA_ROUNDS = 8  # four leave neighbouring keys alike, which shows as streaks in a picture


def keyed_sampler(pixel: DeviceIndex, ray: DeviceIndex, seed: DeviceIndex) -> Any:
    """A sampler for a wavefront of rays.

    pixel, ray: the key of each ray, its pixel and its number in the pixel. seed: of the picture and the purpose.
    """
    return _sampler_class()(pixel, ray, seed)


def lattice_numbers(pixel: DeviceIndex, ray: DeviceIndex, seed: DeviceIndex, count: int) -> list[Any]:
    """`count` numbers in [0, 1) for each ray, spread evenly over the rays of a pixel, in each pixel differently.

    Source:
        Roberts, The unreasonable effectiveness of quasirandom sequences (2018): the additive recurrence of the
        generalised golden ratio; each pixel shifts it at random (Cranley and Patterson, 1976). In 32-bit integers,
        which wrap as the recurrence does.
    """
    mi, dr = backend.load(), backend.jit()
    numbers: list[Any] = []
    for dimension, step in enumerate(_recurrence(count)):
        shift = mi.sample_tea_32(pixel, seed + dr.opaque(mi.UInt32, dimension), rounds=TEA_ROUNDS)[0]
        numbers.append(mi.Float((ray * mi.UInt32(step) + shift) >> (32 - LATTICE_BITS)) * 2.0**-LATTICE_BITS)
    return numbers


def _recurrence(dimensions: int) -> list[int]:
    """Steps of the recurrence as shares of 2^32: powers of 1 / g, where g^(dimensions + 1) = g + 1."""
    golden = 1.5
    for _ in range(64):
        golden = (1.0 + golden) ** (1.0 / (dimensions + 1))
    return [round(golden ** -(k + 1) * 2**32) for k in range(dimensions)]


@functools.cache
def _sampler_class() -> Any:
    mi = backend.load()

    class KeyedSampler(mi.Sampler):
        def __init__(self, pixel: DeviceIndex, ray: DeviceIndex, seed: DeviceIndex) -> None:
            super().__init__(mi.Properties())
            self.numbers = mi.PCG32(size=1)
            self.numbers.seed(mi.sample_tea_64(pixel, seed, rounds=TEA_ROUNDS), mi.UInt64(ray))

        def next_1d(self, active: Any = True) -> Any:
            return self.numbers.next_float32(active)

        def next_2d(self, active: Any = True) -> Any:
            first = self.numbers.next_float32(active)
            return mi.Point2f(first, self.numbers.next_float32(active))

    return KeyedSampler
