"""Worlds: what stands around the target and lights it, as values and as Mitsuba scenes."""

from __future__ import annotations

from render.world.description import World
from render.world.draw import WorldDraw, draw_world

__all__ = ["World", "WorldDraw", "draw_world"]
