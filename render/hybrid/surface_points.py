"""Points of a surface as Mitsuba's surface interactions, without a ray that found them."""

from __future__ import annotations

from typing import Any  # Any: Mitsuba's objects, whose types depend on its variant

from render import backend
from render.device import DeviceVector3


def surface_points(position: DeviceVector3, normal: DeviceVector3, toward: DeviceVector3) -> Any:
    """Interactions at points, mm, with unit normals; light is asked for that leaves along the unit vectors `toward`."""
    mi, dr = backend.load(), backend.jit()
    surface = dr.zeros(mi.SurfaceInteraction3f, dr.width(position))
    surface.p, surface.n = mi.Point3f(position), mi.Normal3f(normal)
    surface.sh_frame = mi.Frame3f(surface.n)
    surface.wi = surface.to_local(toward)
    surface.t = dr.opaque(mi.Float, 1.0)  # finite: the interaction is valid
    return surface
