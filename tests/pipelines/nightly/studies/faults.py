"""Faults to plant: each changes what the candidate reads, by a size that can be varied. Test code only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from tests.pipelines.nightly.studies.reading import ALL, DETECTOR, FOUR, NOISY

LENS = "equisolid"  # where faults of one lens are


@dataclass(frozen=True, slots=True)
class Fault:
    """One kind of fault."""

    name: str
    unit: str
    size: float  # that must be caught
    plant: Callable  # (reading, size, rng) changes the reading
    slices: tuple[str, ...]  # ends of the names of the slices that it is in
    everywhere: bool = False  # in all lenses

    def is_named_by(self, outcomes):
        """Whether failed gates name a slice where it is, and no slice of another lens."""
        named = [item.slice for outcome in outcomes for item in outcome.findings]
        right = any(name.endswith(end) for name in named for end in self.slices)
        return right and (self.everywhere or all(f"/{LENS}/" in name for name in named))


def _lens(reading):
    return reading.views.pool.cameras.index(LENS)


def corner_bias(reading, size, rng):
    """Corners of one lens lie too far along x, px."""
    reading.seen(_lens(reading)).error[..., :-1, 0] += size


def more_noise(reading, size, rng):
    """Corners of one lens scatter more by a share: noise of their own is added, with the frame's and axis's scatter."""
    own = reading.seen(_lens(reading)).error[..., :-1, :]
    scatter = np.sqrt(np.mean(own**2, axis=2, keepdims=True))
    own += np.sqrt((1.0 + size) ** 2 - 1.0) * scatter * rng.standard_normal(own.shape)


def circle_shift(reading, size, rng):
    """The circle's centre in one lens lies too far along x, px."""
    reading.seen(_lens(reading)).error[..., -1, 0] += size


def longer_focal_length(reading, size, rng):
    """The solver takes one lens's focal length too long by a share."""
    reading.seen(_lens(reading)).stretch = size


def small_covariance(reading, size, rng):
    """Covariances of the points of one lens are stated too small by a share; the poses' follow."""
    reading.seen(_lens(reading)).covariance *= 1.0 - size


def shift(reading, size, rng):
    """All points of all lenses lie too far along x, px."""
    for camera in range(len(reading.views.pool.cameras)):
        reading.seen(camera).error[..., 0] += size


def new_failure(reading, size, rng):
    """So many frames of one lens have no points any more."""
    poses = rng.permutation(len(reading.views.pose))[: int(size)]
    reading.failed += [(0, int(pose), _lens(reading)) for pose in poses]


def early_end(moves):
    """The solver returns the pose of so many steps before its last. moves: (k, P, C, 6) for each setting."""

    def plant(reading, size, rng):
        for camera in range(len(reading.views.pool.cameras)):
            for setting, of_steps in moves.items():
                reading.seen(camera).moves[setting] = of_steps[int(size) - 1, reading.views.pose, camera]

    return plant


POINTS, POSES = (f"/{LENS}/{DETECTOR}",), tuple(f"/{LENS}/{system}" for system in (ALL, FOUR, NOISY))
CORNER_BIAS = Fault("corner bias, one lens", "px", 0.002, corner_bias, POINTS)
MORE_NOISE = Fault("corner noise, one lens", "share", 0.10, more_noise, POINTS)
CIRCLE = Fault("circle's centre, one lens", "px", 0.01, circle_shift, POINTS + POSES)
FOCAL = Fault("focal length, one lens", "share", 5e-5, longer_focal_length, POSES)
COVARIANCE = Fault("stated covariance too small, one lens", "share", 0.15, small_covariance, POINTS + POSES)
SHIFT = Fault("shift, all lenses", "px", 0.01, shift, (f"/{DETECTOR}",), everywhere=True)
FAILURE = Fault("new failures", "frames", 1, new_failure, ())
