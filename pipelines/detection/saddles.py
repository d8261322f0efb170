"""Places where two edges may cross: saddles of the grey values with four alternating sectors around them.

A saddle's strength is compared with the contrast around it, so that a dim board counts as much as a bright one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import cv2
import numpy as np

from eposit.arrays import Array, Mask
from pipelines.detection.kernels import compiled, compiled_part
from pipelines.detection.saddle_peaks import AROUND_PX, FLAT_GREY, SMOOTHING_PX, noise_of, strongest_saddles
from pipelines.detection.sampling import Level, grey_at

RING_PX, RING_SAMPLES = 3.5, 32
TURN = np.arange(RING_SAMPLES) * (2.0 * np.pi / RING_SAMPLES)
RING = np.stack((np.cos(TURN), np.sin(TURN)), axis=1)
LEAST_SWING = 6.0  # noises between the ring's brightest and darkest sample
OPPOSITE_RAD = 0.7  # how far an edge may bend at the saddle, as seen from the ring


class Saddles(NamedTuple):
    """n saddles, the strongest first."""

    points: Array  # (n, 2) px of the level
    angles: Array  # (n, 4) rising directions of the four edges that leave the saddle, rad, from x towards y
    brightens: Mask  # (n,) whether grey values rise across the first edge with rising angle; they do at each other edge
    swing: Array  # (n,) grey levels between the brightest and the darkest sector


def smooth(level: Level) -> Level:
    """The level as saddles are looked for in it."""
    return np.asarray(cv2.GaussianBlur(level, (0, 0), SMOOTHING_PX), np.float32)


def find_saddles(smoothed: Level) -> Saddles:
    """Saddles of a smoothed level that have four alternating sectors."""
    if min(smoothed.shape) <= 2 * AROUND_PX:
        return Saddles(np.empty((0, 2)), np.empty((0, 4)), np.empty(0, bool), np.empty(0))
    noise = noise_of(smoothed)
    return _with_four_sectors(smoothed, strongest_saddles(smoothed, noise), noise)


def _with_four_sectors(smoothed: Level, points: Array, noise: float) -> Saddles:
    """Those around which a ring crosses the mean of its extremes four times, at two nearly straight lines."""
    n = len(points)
    angles, brightens, swing = np.empty((n, 4)), np.empty(n, bool), np.empty(n)
    _look_around(smoothed, points, RING_PX * RING, np.empty(RING_SAMPLES), angles, brightens, swing)
    straight = swing > LEAST_SWING * noise + FLAT_GREY
    return Saddles(points[straight], angles[straight], brightens[straight], swing[straight])


@compiled
def _look_around(
    smoothed: Level, points: Array, ring: Array, grey: Array, angles: Array, brightens: Mask, swing: Array
) -> None:
    """Fill in what the ring (m, 2) px around each place shows; the swing is 0 where it shows no four sectors.

    grey: (m,) workspace.
    """
    for i in range(len(points)):
        low, high = np.inf, -np.inf
        for k in range(len(ring)):
            grey[k] = grey_at(smoothed, points[i, 0] + ring[k, 0], points[i, 1] + ring[k, 1])
            low, high = min(low, grey[k]), max(high, grey[k])
        swing[i] = high - low if _find_sectors(grey, 0.5 * (low + high), angles[i]) else 0.0
        brightens[i] = grey[0] < 0.5 * (low + high)  # so are all up to the first crossing


@compiled_part
def _find_sectors(grey: Array, middle: float, angles: Array) -> bool:
    """Fill in where a ring of grey values crosses the middle, rad; whether it does four times, at two lines."""
    count, samples = 0, len(grey)
    for k in range(samples):
        here, following = grey[k] - middle, grey[(k + 1) % samples] - middle
        if (here < 0.0) != (following < 0.0):
            if count < 4:
                angles[count] = (k + here / (here - following)) * (2.0 * math.pi / samples)
            count += 1
    if count != 4:
        return False
    one, other = abs(angles[2] - angles[0] - math.pi), abs(angles[3] - angles[1] - math.pi)
    return one < OPPOSITE_RAD and other < OPPOSITE_RAD


def prepare() -> None:
    """Call each compiled function once."""
    _with_four_sectors(np.zeros((2, 2), np.float32), np.zeros((1, 2)), 0.0)
