"""Rays of a camera at a pose through places of a film, in Dr.Jit."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eposit.arrays import Array
from render import backend
from render.device import DeviceBool, DeviceFloat, DeviceMatrix3, DevicePoint2, DevicePoint3, DeviceVector3
from render.lens_law import DeviceLens, incidence_angle
from render.motion import RollingPose
from render.pupil import Pupil, pupil_place
from render.targets.image_region import Region

ROW_NUMBERS = 12  # nine of a rotation, three of an origin


@dataclass(slots=True)
class FilmRays:
    """A camera at a pose, uploaded; its numbers are opaque, so that one kernel serves all of a lens."""

    law: DeviceLens
    scale: DevicePoint2  # from positions in [0, 1] of the film's crop to normalised image coordinates
    shift: DevicePoint2
    rotation: DeviceMatrix3  # to the scene's frame from the camera's
    origin: DevicePoint3
    rows: DeviceFloat | None = None  # ROW_NUMBERS for each row of the film, under a rolling shutter
    pupil: list[DeviceFloat] | None = None  # radius, mm, and 1 / focus distance

    def through(self, on_film: DevicePoint2, on_pupil: DevicePoint2) -> tuple[DevicePoint3, DeviceVector3, DeviceBool]:
        """Origin and unit direction of rays in the scene's frame, and whether the lens sees them.

        on_film, on_pupil: in the unit square.
        """
        mi, dr = backend.load(), backend.jit()
        direction, seen = _direction(self.law, on_film * self.scale + self.shift)
        rotation, origin = self._placement(on_film.y)
        if self.pupil is not None:
            disc = mi.warp.square_to_uniform_disk_concentric(on_pupil) * self.pupil[0]
            place = mi.Vector3f(*pupil_place((direction.x, direction.y, direction.z), (disc.x, disc.y)))
            direction, origin = direction - place * self.pupil[1], origin + rotation @ place
        return mi.Point3f(origin), dr.normalize(rotation @ direction), seen

    def _placement(self, down: DeviceFloat) -> tuple[DeviceMatrix3, DevicePoint3]:
        """Rotation and origin at the time of the row that lies at a height of the film, from 0 to 1."""
        if self.rows is None:
            return self.rotation, self.origin
        mi, dr = backend.load(), backend.jit()
        rows = dr.width(self.rows) // ROW_NUMBERS
        row = dr.clip(dr.floor(down * rows), 0.0, rows - 1.0)
        numbers = [dr.gather(mi.Float, self.rows, mi.UInt32(row) * ROW_NUMBERS + i) for i in range(ROW_NUMBERS)]
        return mi.Matrix3f(*numbers[:9]), mi.Point3f(*numbers[9:])

    def open_pupil(self, pupil: Pupil) -> None:
        """See through an open pupil from now on."""
        mi, dr = backend.load(), backend.jit()
        self.pupil = [dr.opaque(mi.Float, value) for value in (pupil.radius_mm, 1.0 / pupil.focus_mm)]


def row_placements(cam_from_obj: RollingPose, tile: Region, world_from_obj: Array) -> DeviceFloat:
    """ROW_NUMBERS numbers for each row of a tile: rotation and origin of the scene's frame from the camera's.

    A tile's rows below the picture have the poses of a longer picture; nobody sees them.
    """
    obj_from_cam = cam_from_obj.at_rows(np.arange(tile.y, tile.y + tile.height)).inverse()
    rotation = world_from_obj[:3, :3] @ obj_from_cam.R
    origin = obj_from_cam.t @ world_from_obj[:3, :3].T + world_from_obj[:3, 3]
    table = np.concatenate((rotation.reshape(-1, 9), origin), axis=1)
    return backend.upload(table.ravel())


def _direction(law: DeviceLens, image: DevicePoint2) -> tuple[DeviceVector3, DeviceBool]:
    """Directions of rays in camera axes through normalised image coordinates, and whether the lens sees them."""
    mi, dr = backend.load(), backend.jit()
    rho = dr.norm(image)
    theta = incidence_angle(law, dr.minimum(rho, law.rho_max))
    side = dr.select(rho > 0.0, theta.sine / rho, 1.0)  # on the axis both coordinates are 0
    return mi.Vector3f(image.x * side, image.y * side, theta.cosine), rho <= law.rho_max
