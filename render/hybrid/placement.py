"""The object frame's place in a Mitsuba scene, which may have other axes and units than ours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any  # Any: Mitsuba's objects, whose types depend on its variant

import numpy as np

from eposit.arrays import Array
from render import backend
from render.device import DeviceVector3


@dataclass(frozen=True, slots=True, eq=False)
class Placement:
    """A similarity from the object frame, mm, to a scene's frame and units."""

    world_from_obj: Array  # (4, 4)

    @property
    def scale(self) -> float:
        """Scene units in a millimetre."""
        return float(abs(np.linalg.det(self.world_from_obj[:3, :3])) ** (1.0 / 3.0))

    def surface(self, position: DeviceVector3, normal: DeviceVector3, toward: DeviceVector3) -> Any:
        """Points of a surface as Mitsuba's surface interactions, without a ray that found them.

        position: mm, object frame. normal, toward: unit vectors; light is asked for that leaves along `toward`.
        """
        mi, dr = backend.load(), backend.jit()
        surface = dr.zeros(mi.SurfaceInteraction3f, dr.width(position))
        surface.p, surface.n = self._point(position), mi.Normal3f(self._direction(normal))
        surface.sh_frame = mi.Frame3f(surface.n)
        surface.wi = surface.to_local(self._direction(toward))
        surface.t = dr.opaque(mi.Float, 1.0)  # finite: the interaction is valid
        return surface

    def ray(self, ray: Any) -> Any:
        """Mitsuba's rays, from the object frame to the scene's."""
        return backend.load().Ray3f(self._point(ray.o), self._direction(ray.d))

    def _point(self, position: DeviceVector3) -> Any:
        mi = backend.load()
        x, y, z = self._columns(self.world_from_obj[:3, :3])
        (shift,) = self._columns(self.world_from_obj[:3, 3:])
        return mi.Point3f(x * position.x + y * position.y + z * position.z + shift)

    def _direction(self, direction: DeviceVector3) -> Any:
        x, y, z = self._columns(self.world_from_obj[:3, :3] / self.scale)
        return x * direction.x + y * direction.y + z * direction.z

    def _columns(self, matrix: Array) -> list[Any]:
        """Columns as opaque vectors, so that one kernel serves all places."""
        mi, dr = backend.load(), backend.jit()
        return [mi.Vector3f(*(dr.opaque(mi.Float, float(v)) for v in column)) for column in matrix.T]
