"""Where rays meet planes of constant z, and how that place changes over a cell of the picture, in Dr.Jit."""

from __future__ import annotations

from dataclasses import dataclass

from render import backend
from render.analytic.rays import RayBundle
from render.device import DeviceBool, DeviceFloat

FAR = 1e6  # mm; what lies farther, or is not finite, is taken for this

Steps = tuple[DeviceFloat, DeviceFloat]  # changes of a quantity over a cell's width and height


@dataclass(frozen=True, slots=True)
class PlaneHit:
    """Where rays meet a plane of constant z."""

    x: DeviceFloat  # mm
    y: DeviceFloat
    steps_x: Steps  # of x, mm
    steps_y: Steps
    met: DeviceBool  # whether the plane lies ahead


def meet_plane(rays: RayBundle, z: DeviceFloat | float, size: DeviceFloat) -> PlaneHit:
    """Where rays meet the plane at z, mm. size: side of a cell, px."""
    dr = backend.jit()
    direction, origin = rays.direction, rays.origin
    inverse = 1.0 / direction.z
    length = (z - origin[2]) * inverse
    x, y = origin[0] + length * direction.x, origin[1] + length * direction.y
    slope_x, slope_y, scale = direction.x * inverse, direction.y * inverse, length * size
    along_x, along_y = rays.along_x, rays.along_y
    return PlaneHit(
        x=dr.select(dr.abs(x) < FAR, x, FAR),
        y=dr.select(dr.abs(y) < FAR, y, FAR),
        steps_x=(scale * (along_x.x - slope_x * along_x.z), scale * (along_y.x - slope_x * along_y.z)),
        steps_y=(scale * (along_x.y - slope_y * along_x.z), scale * (along_y.y - slope_y * along_y.z)),
        met=length > 0.0,
    )


def distance_from(hit: PlaneHit, x: DeviceFloat, y: DeviceFloat) -> tuple[DeviceFloat, Steps]:
    """Distance of hits from a point of their plane, mm, and its changes over the cell."""
    dr = backend.jit()
    dx, dy = hit.x - x, hit.y - y
    distance = dr.sqrt(dx * dx + dy * dy)
    inverse = dr.select(distance > 0.0, 1.0 / distance, 0.0)
    ux, uy = dx * inverse, dy * inverse
    (x_across, x_down), (y_across, y_down) = hit.steps_x, hit.steps_y
    return distance, (ux * x_across + uy * y_across, ux * x_down + uy * y_down)
