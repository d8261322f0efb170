"""What is random of a world, drawn once for a dataset or for each pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np

from render.world.description import World


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldDraw:
    """One draw of a world: everything random of it follows from these values."""

    layout_seed: Annotated[int, "seed of the places, sizes and colours of all things of the world, 63 bits"]
    has_target: Annotated[bool, "whether the target stands in the world"]
    clutter: Annotated[int, "objects around the target"]
    occluders: Annotated[int, "poles and balls in front of the target"]
    boards: Annotated[int, "other chessboards"]
    roughness: Annotated[float, "roughness of the board's rough plastic"]
    lamp_power: Annotated[float, "power of the room's lamps, as a share of the usual one"]
    lamp_shift_mm: Annotated[float, "how far each lamp hangs from its usual place"]
    sun_elevation_deg: Annotated[float, "height of the sun above the horizon"]
    rotation_deg: Annotated[float, "turn of sun, sky or environment map about the vertical"]
    exposure: Annotated[float, "exposure as a share of the sensor's"]


def draw_world(world: World, rng: np.random.Generator) -> WorldDraw:
    """One draw; a value's random number does not depend on the other values' ranges."""

    def value(name: str) -> float:
        low, high = getattr(world, name)
        return float(low + (high - low) * rng.random())

    def count(name: str) -> int:
        low, high = getattr(world, name)
        return int(low + min(int((high - low + 1) * rng.random()), high - low))

    return WorldDraw(
        layout_seed=int(rng.integers(2**63)),
        has_target=bool(rng.random() >= world.absent_share),
        clutter=count("clutter"),
        occluders=count("occluders"),
        boards=count("boards"),
        roughness=value("roughness_range"),
        lamp_power=value("lamp_power_range"),
        lamp_shift_mm=value("lamp_shift_range_mm"),
        sun_elevation_deg=value("sun_elevation_range_deg"),
        rotation_deg=value("rotation_range_deg"),
        exposure=value("exposure_range"),
    )
