"""Where rays meet a bent sheet, in the nominal lengths of its print, in Dr.Jit."""

from __future__ import annotations

from dataclasses import dataclass

from render import backend
from render.analytic.device_print import DeviceSheet
from render.analytic.plane_hit import FAR, PlaneHit
from render.analytic.rays import RayBundle
from render.device import DeviceBool, DeviceFloat, DeviceVector3

NEWTON_STEPS = 6
MISS_MM = 0.02  # what a float32 leaves of a distance of some metres after Newton's steps is a hundredth of it
BEYOND = 1.05  # half sides from the middle; farther out a sheet is taken for flat
NEARLY_FLAT = 1e-3  # radian, up to which an arc's sine is worked out by its series


@dataclass(frozen=True, slots=True)
class _Height:
    """The sheet at places of the object frame."""

    z: DeviceFloat  # mm
    rise_x: DeviceFloat  # of z along x
    rise_y: DeviceFloat


def meet_sheet(rays: RayBundle, sheet: DeviceSheet, size: DeviceFloat) -> tuple[PlaneHit, DeviceBool]:
    """Where rays meet the sheet, mm of the print, and whether they meet its front. size: side of a cell, px.

    No part of the sheet may hide another.
    """
    dr = backend.jit()
    direction, (x0, y0, z0) = rays.direction, rays.origin
    x0, y0 = x0 - sheet.centre[0], y0 - sheet.centre[1]
    length = -z0 / direction.z
    for _ in range(NEWTON_STEPS):
        height = _height(sheet, x0 + length * direction.x, y0 + length * direction.y)
        length -= (z0 + length * direction.z - height.z) / _closing(height, direction)
    x, y = x0 + length * direction.x, y0 + length * direction.y
    height = _height(sheet, x, y)
    closing = _closing(height, direction)
    met = (length > 0.0) & (dr.abs(z0 + length * direction.z - height.z) < MISS_MM)
    slope_x, slope_y, scale = direction.x / closing, direction.y / closing, length * size

    def steps(change: DeviceFloat, slope: DeviceFloat, along: DeviceVector3) -> DeviceFloat:
        return scale * (change - slope * _closing(height, along))

    (at_x, stretch_x), (at_y, stretch_y) = (_along_sheet(sheet, i, value) for i, value in enumerate((x, y)))
    across, down = rays.along_x, rays.along_y
    hit = PlaneHit(
        x=dr.select(dr.abs(at_x) < FAR, at_x, FAR),
        y=dr.select(dr.abs(at_y) < FAR, at_y, FAR),
        steps_x=(stretch_x * steps(across.x, slope_x, across), stretch_x * steps(down.x, slope_x, down)),
        steps_y=(stretch_y * steps(across.y, slope_y, across), stretch_y * steps(down.y, slope_y, down)),
        met=met,
    )
    return hit, closing > 0.0


def _closing(height: _Height, direction: DeviceVector3) -> DeviceFloat:
    """How fast a direction leads through the sheet, from front to back."""
    return direction.z - height.rise_x * direction.x - height.rise_y * direction.y


def _height(sheet: DeviceSheet, x: DeviceFloat, y: DeviceFloat) -> _Height:
    """The sheet at x, y from its middle, mm."""
    dr = backend.jit()
    (half_x, half_y), (kx, ky) = sheet.half_side, sheet.curvature
    x = dr.clip(x, -BEYOND * half_x, BEYOND * half_x)
    y = dr.clip(y, -BEYOND * half_y, BEYOND * half_y)
    root_x, root_y = dr.sqrt(1.0 - dr.square(kx * x)), dr.sqrt(1.0 - dr.square(ky * y))
    a, b = x / half_x, y / half_y
    square_a, square_b = a * a, b * b
    return _Height(
        z=kx * x * x / (1.0 + root_x)
        + ky * y * y / (1.0 + root_y)
        + sheet.pillow * (square_a + square_b - square_a * square_b),
        rise_x=kx * x / root_x + 2.0 * sheet.pillow * a * (1.0 - square_b) / half_x,
        rise_y=ky * y / root_y + 2.0 * sheet.pillow * b * (1.0 - square_a) / half_y,
    )


def _along_sheet(sheet: DeviceSheet, axis: int, value: DeviceFloat) -> tuple[DeviceFloat, DeviceFloat]:
    """Nominal place of an x or y from the sheet's middle, mm, and its change for a change of that."""
    dr = backend.jit()
    sine = dr.clip(sheet.curvature[axis] * value, -0.9, 0.9)
    arc = dr.select(dr.abs(sine) < NEARLY_FLAT, 1.0 + sine * sine / 6.0, dr.asin(sine) / sine)
    per_mm = sheet.per_mm[axis]
    return (value * arc + sheet.centre[axis]) * per_mm, per_mm / dr.sqrt(1.0 - sine * sine)
