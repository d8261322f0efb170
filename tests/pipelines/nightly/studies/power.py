"""How often a planted fault ends a simulated night with exit code 1, and how small it may be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.pipelines.nightly.studies import faults
from tests.pipelines.nightly.studies.reading import Reading, Views
from tests.pipelines.nightly.studies.simulated_nights import OTHER, Planted, Stage, failed, is_worse, pinned_only

LEAST = 0.95
DRIFT_PX, DRIFT_NIGHTS = 0.0001, 30


@dataclass(frozen=True, slots=True)
class Share:
    """Of so many nights."""

    nights: int
    caught: float  # end with exit code 1
    right: float  # name the slice that the fault is in, and no other lens


def stages(pool, poses, noise, nights):
    """So many nights to plant faults in."""
    return [Stage(pool, poses, noise, (poses, i)) for i in range(nights)]


def share(nights, planted):
    """Of nights that a fault is planted in."""
    caught = right = 0
    for stage in nights:
        night = stage.night(planted)
        caught += is_worse(night)
        right += is_worse(night) and _is_right(planted, night)
    return Share(len(nights), caught / len(nights), right / len(nights))


def _is_right(planted, night):
    named = failed(night)
    if planted.slower:
        return [item.gate for item in named] == ["speed"] and named[0].sentence.startswith("detect ")
    if planted.fault is faults.FAILURE:
        return "failures" in [item.gate for item in named] and f"/{faults.LENS}/" in named[0].sentence
    return planted.fault.is_named_by(named)


def smallest(nights, fault, low, high, steps=5):
    """The smallest of 2**steps geometric sizes between `low` and `high` that is caught often enough, by bisection.

    None if even `high` is not.
    """
    if share(nights, Planted(fault, high)).caught < LEAST:
        return None
    for _ in range(steps):
        middle = float(np.sqrt(low * high))
        if share(nights, Planted(fault, middle)).caught < LEAST:
            low = middle
        else:
            high = middle
    return high


def drift_nights(pool, poses, noise, runs, seed=0):
    """(runs,) the first night that a bias is caught which grows by DRIFT_PX a night; 0 if none of DRIFT_NIGHTS is."""
    return [_first_night(pool, poses, noise, np.random.default_rng((seed, i))) for i in range(runs)]


def _first_night(pool, poses, noise, rng):
    views = Views.drawn(pool, poses, rng)
    old = Reading(views).slices()
    for night in range(1, DRIFT_NIGHTS + 1):
        new = Reading(views.with_other_noise(rng) if noise == OTHER else views)
        faults.CORNER_BIAS.plant(new, night * DRIFT_PX, rng)
        if is_worse(pinned_only(old, new.slices())):
            return night
    return 0
