"""The fish-eye sensor plugin: one for all lenses, by exact per-ray inverse projection.

It is what makes Mitsuba's own integrators see through our lenses: they are the reference for `render.analytic`.
Only here are pixel coordinates shifted by half a pixel: Mitsuba's pixel i covers [i, i + 1), OpenCV's centre is i.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from eposit import Camera, Pose
from render import backend
from render.lens_law import device_lens, sine_cosine

SENSOR = "eposit_fisheye"
HALF_PIXEL = 0.5


def sensor_dict(camera: Camera, cam_from_obj: Pose, region: tuple[int, int, int, int], samples: int) -> dict[str, Any]:
    """Mitsuba description of `camera` at a pose, for a region (x, y, width, height) of its picture.

    cam_from_obj: the pose; the object frame is the world frame.
    Raises:
        BackendError: Mitsuba cannot run here.
    """
    mi = backend.load()
    register_sensor()
    x, y, width, height = region
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
            "crop_offset_x": x,
            "crop_offset_y": y,
            "crop_width": width,
            "crop_height": height,
            "pixel_format": "luminance_alpha",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "multijitter", "sample_count": samples},
    }


@functools.cache
def register_sensor() -> None:
    """Define and register the plugin, once in this process.

    Raises:
        BackendError: Mitsuba cannot run here.
    """
    mi, dr = backend.load(), backend.jit()

    class Fisheye(mi.Sensor):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            coefficients = tuple(props[f"k{i}"] for i in range(1, 5) if f"k{i}" in props)
            fx, fy, cx, cy = (props[name] for name in ("fx", "fy", "cx", "cy"))
            to_world = np.array(props["to_world"].matrix, dtype=np.float64)
            size, offset = self.film().crop_size(), self.film().crop_offset()
            self.law = device_lens(mi, dr, props["lens"], coefficients)
            # From the film position in [0, 1] of the crop to normalised image coordinates. The constants are worked
            # out in double precision: at 1600 px a float32 coordinate is only good to 1e-4 px.
            scale = np.array([size.x / fx, size.y / fy])
            shift = np.array([(offset.x - HALF_PIXEL - cx) / fx, (offset.y - HALF_PIXEL - cy) / fy])
            self.scale, self.shift = mi.Vector2f(scale), mi.Vector2f(shift)
            self.rotation, self.origin = mi.Matrix3f(to_world[:3, :3]), mi.Point3f(to_world[:3, 3])
            # Opaque, so that one kernel serves all poses, regions and cameras of a lens.
            dr.make_opaque(self.scale, self.shift, self.rotation, self.origin)
            self.m_needs_sample_2 = True

        def sample_ray(self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True) -> Any:
            image = sample2 * self.scale + self.shift
            radius = dr.norm(image)
            seen = radius <= self.law.rho_max
            sine, cosine, _ = sine_cosine(mi, dr, self.law, dr.minimum(radius, self.law.rho_max))
            side = dr.select(radius > 0.0, sine / radius, 1.0)
            direction = mi.Vector3f(image.x * side, image.y * side, cosine)
            ray = dr.zeros(mi.Ray3f, dr.width(direction))
            ray.o, ray.d, ray.time = mi.Point3f(self.origin), dr.normalize(self.rotation @ direction), time
            ray.maxt = dr.select(seen, dr.largest(mi.Float), 0.0)
            return ray, dr.select(seen, mi.Spectrum(1.0), mi.Spectrum(0.0))

        def sample_ray_differential(
            self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True
        ) -> Any:
            ray, weight = self.sample_ray(time, sample1, sample2, sample3, active)
            return mi.RayDifferential3f(ray), weight

        def bbox(self) -> Any:
            return mi.ScalarBoundingBox3f()

        def to_string(self) -> str:
            return f"Fisheye[{self.law.name}]"

    mi.register_sensor(SENSOR, Fisheye)
