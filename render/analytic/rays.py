"""Rays of a camera at a pose, through points of the picture, in Dr.Jit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from eposit import Camera, Pose
from render import backend
from render.lens_law import DeviceLens, device_lens, sine_cosine


@dataclass(frozen=True, slots=True)
class Bundle:
    """Rays through points of the picture: directions in the object frame and their change over a pixel."""

    direction: Any  # Vector3f of unit length
    along_x: Any  # Vector3f, change of the direction for one pixel along x
    along_y: Any  # Vector3f, for one pixel along y
    seen: Any  # Bool, whether the point lies inside the lens's image circle


@dataclass(frozen=True, slots=True)
class DeviceCamera:
    """A camera at a pose, uploaded."""

    law: DeviceLens
    focal: list[Any]  # fx, fy, px
    centre: list[Any]  # cx, cy, px
    rotation: list[Any]  # nine numbers of obj_from_cam, row by row
    origin: list[Any]  # camera centre in the object frame, mm

    def rays(self, x_px: Any, y_px: Any) -> Bundle:
        """Rays through points of the picture, px, pixel centres at integers."""
        mi, dr = backend.load(), backend.jit()
        x, y = (x_px - self.centre[0]) / self.focal[0], (y_px - self.centre[1]) / self.focal[1]
        radius = dr.sqrt(x * x + y * y)
        sine, cosine, slope = sine_cosine(mi, dr, self.law, dr.minimum(radius, self.law.rho_max))
        off_axis = radius > 0.0
        inverse = dr.select(off_axis, 1.0 / radius, 0.0)
        side = dr.select(off_axis, sine * inverse, 1.0)
        ex, ey = x * inverse, y * inverse
        # direction = (x side, y side, cosine): along the radius the sine's slope counts, across it `side`.
        bend, fall = dr.select(off_axis, cosine * slope - side, 0.0), -sine * slope
        in_cam = (x * side, y * side, cosine)
        step_x = ((side + bend * ex * ex) / self.focal[0], bend * ex * ey / self.focal[0], fall * ex / self.focal[0])
        step_y = (bend * ex * ey / self.focal[1], (side + bend * ey * ey) / self.focal[1], fall * ey / self.focal[1])
        direction, along_x, along_y = (self._turn(mi, vector) for vector in (in_cam, step_x, step_y))
        return Bundle(direction, along_x, along_y, radius <= self.law.rho_max)

    def _turn(self, mi: Any, v: tuple[Any, Any, Any]) -> Any:
        r = self.rotation
        return mi.Vector3f(*(r[i] * v[0] + r[i + 1] * v[1] + r[i + 2] * v[2] for i in (0, 3, 6)))


def device_camera(camera: Camera, cam_from_obj: Pose) -> DeviceCamera:
    """Upload a camera at a pose."""
    mi, dr = backend.load(), backend.jit()
    obj_from_cam = cam_from_obj.inverse()
    numbers = [camera.fx, camera.fy, camera.cx, camera.cy, *obj_from_cam.R.ravel(), *obj_from_cam.t]
    up = [dr.opaque(mi.Float, float(value)) for value in numbers]
    return DeviceCamera(device_lens(mi, dr, camera.lens, camera.coefficients), up[:2], up[2:4], up[4:13], up[13:])
