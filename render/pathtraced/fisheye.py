"""The fish-eye sensor plugin: one for all lenses, by exact per-ray inverse projection.

It is what makes Mitsuba's own integrators see through our lenses: they are the reference for `render.analytic`.
Only here are pixel coordinates shifted by half a pixel: Mitsuba's pixel i covers [i, i + 1), OpenCV's centre is i.
"""

from __future__ import annotations

import functools
from typing import Any  # Any: Mitsuba describes a sensor by dictionaries of mixed values

import numpy as np

from eposit import Camera, Pose
from render import backend
from render.device import (
    DeviceBool,
    DeviceBox,
    DeviceFloat,
    DevicePoint2,
    DeviceRay,
    DeviceRayDifferential,
    DeviceSpectrum,
)
from render.lens_law import device_lens, incidence_angle
from render.targets.image_region import Region

SENSOR = "eposit_fisheye"
HALF_PIXEL = 0.5


def sensor_dict(camera: Camera, cam_from_obj: Pose, region: Region, samples: int) -> dict[str, Any]:
    """Mitsuba description of `camera` at a pose, for a region of its picture.

    cam_from_obj: the pose; the object frame is the world frame.
    Raises:
        BackendError: Mitsuba cannot run here.
    """
    mi = backend.load()
    register_sensor()
    obj_from_cam = cam_from_obj.inverse()
    to_world = np.eye(4)
    to_world[:3] = np.column_stack((obj_from_cam.R, obj_from_cam.t))
    return {
        "type": SENSOR,
        "lens": camera.lens,
        **{name: getattr(camera, name) for name in ("fx", "fy", "cx", "cy")},
        **{f"k{i}": k for i, k in enumerate(camera.coefficients, 1)},
        "to_world": mi.ScalarTransform4f(to_world),
        "film": {
            "type": "hdrfilm",
            "width": camera.width,
            "height": camera.height,
            "crop_offset_x": region.x,
            "crop_offset_y": region.y,
            "crop_width": region.width,
            "crop_height": region.height,
            "pixel_format": "luminance_alpha",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "multijitter", "sample_count": samples},
    }


@functools.cache
def register_sensor() -> None:
    """Define and register the plugin, once in this process.

    Mitsuba has no class to derive from before its variant is set, so that the class is defined in here.

    Raises:
        BackendError: Mitsuba cannot run here.
    """
    mi, dr = backend.load(), backend.jit()

    class Fisheye(mi.Sensor):
        def __init__(self, props: Any) -> None:  # Any: values of the dictionary above
            super().__init__(props)
            coefficients = tuple(props[f"k{i}"] for i in range(1, 5) if f"k{i}" in props)
            fx, fy, cx, cy = (props[name] for name in ("fx", "fy", "cx", "cy"))
            to_world = np.array(props["to_world"].matrix, dtype=np.float64)
            size, offset = self.film().crop_size(), self.film().crop_offset()
            self.law = device_lens(props["lens"], coefficients)
            # From the film position in [0, 1] of the crop to normalised image coordinates. The constants are worked
            # out in double precision: at 1600 px a float32 coordinate is only good to 1e-4 px.
            scale = np.array([size.x / fx, size.y / fy])
            shift = np.array([(offset.x - HALF_PIXEL - cx) / fx, (offset.y - HALF_PIXEL - cy) / fy])
            self.scale, self.shift = mi.Vector2f(scale), mi.Vector2f(shift)
            self.rotation, self.origin = mi.Matrix3f(to_world[:3, :3]), mi.Point3f(to_world[:3, 3])
            # Opaque, so that one kernel serves all poses, regions and cameras of a lens.
            dr.make_opaque(self.scale, self.shift, self.rotation, self.origin)
            self.m_needs_sample_2 = True

        def sample_ray(
            self,
            time: DeviceFloat,
            sample1: DeviceFloat,
            sample2: DevicePoint2,
            sample3: DevicePoint2,
            active: DeviceBool | bool = True,
        ) -> tuple[DeviceRay, DeviceSpectrum]:
            image = sample2 * self.scale + self.shift
            radius = dr.norm(image)
            seen = radius <= self.law.rho_max
            theta = incidence_angle(self.law, dr.minimum(radius, self.law.rho_max))
            side = dr.select(radius > 0.0, theta.sine / radius, 1.0)
            direction = mi.Vector3f(image.x * side, image.y * side, theta.cosine)
            ray = dr.zeros(mi.Ray3f, dr.width(direction))
            ray.o, ray.d, ray.time = mi.Point3f(self.origin), dr.normalize(self.rotation @ direction), time
            ray.maxt = dr.select(seen, dr.largest(mi.Float), 0.0)
            return ray, dr.select(seen, mi.Spectrum(1.0), mi.Spectrum(0.0))

        def sample_ray_differential(
            self,
            time: DeviceFloat,
            sample1: DeviceFloat,
            sample2: DevicePoint2,
            sample3: DevicePoint2,
            active: DeviceBool | bool = True,
        ) -> tuple[DeviceRayDifferential, DeviceSpectrum]:
            ray, weight = self.sample_ray(time, sample1, sample2, sample3, active)
            return mi.RayDifferential3f(ray), weight

        def bbox(self) -> DeviceBox:
            return mi.ScalarBoundingBox3f()

        def to_string(self) -> str:
            return f"Fisheye[{self.law.name}]"

    mi.register_sensor(SENSOR, Fisheye)
