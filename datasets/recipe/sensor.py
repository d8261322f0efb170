"""A recipe's sensor: what of it decides a dataset's content."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from render.sensor.presets import SensorModel

LATER_KEYS = ("natural_falloff",)  # not in the first datasets: they take no part in hashes where they have no effect


def sensor_values(sensor: SensorModel) -> dict[str, Any]:
    """All that decides a sensor, for hashes."""
    values = asdict(sensor)
    for key in LATER_KEYS:
        if values[key] == getattr(SensorModel(), key):
            del values[key]
    return values
