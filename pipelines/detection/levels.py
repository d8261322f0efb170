"""A picture at several sizes, the most promising first, none with more pixels than can be looked at quickly."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np

from eposit.arrays import Array
from pipelines.detection.grey_picture import Grey
from pipelines.detection.kernels import compiled
from pipelines.detection.sampling import Level
from pipelines.detection.textured_region import textured_region

MOST_PART = 0.5  # of the picture, for its textured region to be looked at before the whole
FIRST_PIXELS = 7e5  # of the level that is looked at first, at most
MOST_PIXELS = 6.5e6  # of any
LEAST_SIDE_PX = 60  # of a level
ENLARGEMENT, LEAST_ENLARGEMENT, ENLARGED_PIXELS = 3.0, 1.3, 2.5e6


@dataclass(frozen=True, slots=True)
class LevelOf:
    """A picture, or a part of it, reduced or enlarged."""

    grey: Level
    scale: float  # pixels of the picture to one of the level
    first_px: Array  # (2,) px of the picture where the level's first pixel begins, 0.5 less than a pixel's centre

    def in_picture(self, points: Array) -> Array:
        """(n, 2) px of the level as px of the picture; pixel centres are at integers in both."""
        return (points + 0.5) * self.scale - 0.5 + self.first_px

    def in_level(self, points: Array) -> Array:
        """(n, 2) px of the picture as px of the level."""
        return (points - self.first_px + 0.5) / self.scale - 0.5


def levels(image: Grey) -> Iterator[LevelOf]:
    """The levels of an 8-bit picture (height, width)."""
    region = textured_region(image)
    part, first_px = np.ascontiguousarray(image[region.pixels]), np.array([region.x, region.y], np.float64)
    if part.size < MOST_PART * image.size:
        yield _reduced(part, _first_scale(part), first_px)
    first = _first_scale(image)
    finer = [first // 2**k for k in range(1, first.bit_length())]
    yield from (_reduced(image, scale) for scale in [first, *finer[:1]])
    coarser = 2 * first
    while min(image.shape) / coarser >= LEAST_SIDE_PX:
        yield _reduced(image, coarser)
        coarser *= 2
    for scale in finer[1:]:
        if image.size / scale**2 <= MOST_PIXELS:
            yield _reduced(image, scale)
        elif part.size / scale**2 <= MOST_PIXELS:
            yield _reduced(part, scale, first_px)
    enlargement = min(ENLARGEMENT, float(np.sqrt(ENLARGED_PIXELS / part.size)))
    if enlargement >= LEAST_ENLARGEMENT:
        large = cv2.resize(part.astype(np.float32), None, fx=enlargement, fy=enlargement, interpolation=cv2.INTER_CUBIC)
        yield LevelOf(np.asarray(large, np.float32), 1.0 / enlargement, first_px)


def _first_scale(whole: Grey) -> int:
    scale = 1
    while whole.size / scale**2 > FIRST_PIXELS:
        scale *= 2
    return scale


def _reduced(whole: Grey, scale: int, first_px: Array | None = None) -> LevelOf:
    """Means over squares of pixels; what is left over at the right and at the bottom is left out."""
    origin = np.zeros(2) if first_px is None else first_px
    if scale == 1:
        return LevelOf(whole.astype(np.float32), 1.0, origin)
    out = np.empty((whole.shape[0] // scale, whole.shape[1] // scale), np.float32)
    _reduce(whole, scale, out)
    return LevelOf(out, float(scale), origin)


@compiled
def _reduce(whole: Grey, scale: int, out: Level) -> None:
    """Means over squares of pixels. A scale that is a power of two and no more than 256 gives them exactly."""
    share = np.float32(1.0 / (scale * scale))
    for row in range(out.shape[0]):
        for column in range(out.shape[1]):
            total = 0
            for y in range(scale):
                for x in range(scale):
                    total += whole[row * scale + y, column * scale + x]
            out[row, column] = np.float32(total) * share


def prepare() -> None:
    """Call the compiled function once."""
    _reduced(np.zeros((4, 4), np.uint8), 2)
