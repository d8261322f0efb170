"""The target under its light, uploaded to the device that renders."""

from __future__ import annotations

import functools
from dataclasses import dataclass

from eposit.arrays import Array
from render import backend
from render.analytic.device_print import DevicePrint, device_print
from render.device import DeviceFloat
from render.light import Light, shading_map, shadow_radius
from render.targets.chessboard import Chessboard
from render.targets.kinds import AnyTarget


@dataclass(frozen=True, slots=True)
class DeviceAxis:
    """The board along x or along y: its borders and the lines between its squares."""

    low: DeviceFloat  # borders of the board with its margin, mm
    high: DeviceFloat
    first_line: DeviceFloat  # where the squares begin, mm
    squares: DeviceFloat  # how many there are
    texels: DeviceFloat  # of the map of the light


@dataclass(frozen=True, slots=True)
class DeviceDisc:
    """The raised circle."""

    x: DeviceFloat  # centre, mm
    y: DeviceFloat
    z: DeviceFloat
    radius: DeviceFloat  # mm
    radiance: DeviceFloat
    shadow_radius: DeviceFloat  # mm; the lamp's shadow of the disc lies within it on the board


@dataclass(frozen=True, slots=True)
class DeviceTarget:
    """The target under its light as opaque scalars, so that one kernel serves all targets."""

    x: DeviceAxis
    y: DeviceAxis
    square: DeviceFloat  # side of a square, mm
    white: DeviceFloat  # reflectance
    black: DeviceFloat
    disc: DeviceDisc
    shading: DeviceFloat  # (rows * columns,) radiance over reflectance, bilinear between texel centres


@functools.lru_cache(maxsize=4)
def device_target(target: Chessboard, light: Light) -> DeviceTarget:
    """Upload the target and the map of its light, once."""
    return shaded_target(target, *shading_map(target, light), shadow_radius(target, light))


def shaded_target(target: Chessboard, shading: Array, disc_shading: float, shadow_radius_mm: float) -> DeviceTarget:
    """Upload the target and a map of its light.

    shading, disc_shading: as of `render.light.shading_map`. shadow_radius_mm: as of `render.light.shadow_radius`.
    """
    mi, dr = backend.load(), backend.jit()

    def opaque(*values: float) -> list[DeviceFloat]:
        return [dr.opaque(mi.Float, float(value)) for value in values]

    rows, columns = shading.shape
    x0, x1, y0, y1 = target.extent_mm
    disc = (*target.circle_centre, target.circle_radius_mm, disc_shading * target.circle, shadow_radius_mm)
    square, white, black = opaque(target.square_mm, target.white, target.black)
    return DeviceTarget(
        x=DeviceAxis(*opaque(x0, x1, -target.square_mm, target.columns, columns)),
        y=DeviceAxis(*opaque(y0, y1, -target.square_mm, target.rows, rows)),
        square=square,
        white=white,
        black=black,
        disc=DeviceDisc(*opaque(*disc)),
        shading=backend.upload(shading.ravel()),
    )


def device_scene(target: AnyTarget, light: Light) -> DeviceTarget | DevicePrint:
    """The target under its light, uploaded once."""
    return device_target(target, light) if isinstance(target, Chessboard) else device_print(target, light)


def shading_at(target: DeviceTarget | DevicePrint, x: DeviceFloat, y: DeviceFloat) -> DeviceFloat:
    """Radiance over reflectance at points of the board, mm: bilinear in the map, clamped at its border."""
    mi, dr = backend.load(), backend.jit()
    columns, rows = target.x.texels, target.y.texels
    u = dr.clip((x - target.x.low) * (columns / (target.x.high - target.x.low)) - 0.5, 0.0, columns - 1.0)
    v = dr.clip((y - target.y.low) * (rows / (target.y.high - target.y.low)) - 0.5, 0.0, rows - 1.0)
    left, top = dr.minimum(dr.floor(u), columns - 2.0), dr.minimum(dr.floor(v), rows - 2.0)
    across, down = u - left, v - top
    width = mi.Int32(columns)
    first = mi.UInt32(mi.Int32(top) * width + mi.Int32(left))
    below = first + mi.UInt32(width)
    a, b, c, d = (dr.gather(mi.Float, target.shading, i) for i in (first, first + 1, below, below + 1))
    upper, lower = a + across * (b - a), c + across * (d - c)
    return upper + down * (lower - upper)
