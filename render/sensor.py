"""The fish-eye sensor plugin: one for all lenses, by exact per-ray inverse projection.

Only here are pixel coordinates shifted by half a pixel: Mitsuba's pixel i covers [i, i + 1), OpenCV's centre is i.
The inverse laws stand here a second time, in Dr.Jit; tests hold both against OpenCV and closed forms.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from eposit import Camera, Pose, get_lens
from eposit.lens import KANNALA_BRANDT
from render import backend

SENSOR = "eposit_fisheye"
HALF_PIXEL = 0.5
INVERSION_STEPS = 24  # Newton steps inside a bracket; float32 needs about 6, a flat slope at the rim more


def sensor_dict(camera: Camera, cam_from_obj: Pose, region: tuple[int, int, int, int], samples: int) -> dict[str, Any]:
    """Mitsuba description of `camera` at a pose, for a region (x, y, width, height) of its picture.

    cam_from_obj: the pose; the object frame is the world frame.
    Raises:
        BackendError: Mitsuba cannot run here.
    """
    mi = backend.load()
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


def register_sensor(mi: Any, dr: Any) -> None:
    """Define and register the plugin; the variant is set by then."""

    class Fisheye(mi.Sensor):
        def __init__(self, props: Any) -> None:
            super().__init__(props)
            coefficients = tuple(props[f"k{i}"] for i in range(1, 5) if f"k{i}" in props)
            fx, fy, cx, cy = (props[name] for name in ("fx", "fy", "cx", "cy"))
            law = get_lens(props["lens"], coefficients)
            to_world = np.array(props["to_world"].matrix, dtype=np.float64)
            size, offset = self.film().crop_size(), self.film().crop_offset()
            self.law = law.name
            # From the film position in [0, 1] of the crop to normalised image coordinates. The constants are worked
            # out in double precision: at 1600 px a float32 coordinate is only good to 1e-4 px.
            scale = np.array([size.x / fx, size.y / fy])
            shift = np.array([(offset.x - HALF_PIXEL - cx) / fx, (offset.y - HALF_PIXEL - cy) / fy])
            self.scale, self.shift = mi.Vector2f(scale), mi.Vector2f(shift)
            self.rotation, self.origin = mi.Matrix3f(to_world[:3, :3]), mi.Point3f(to_world[:3, 3])
            finite_rim = law.rho_max if np.isfinite(law.rho_max) else 1e30
            self.rho_max, self.theta_max = mi.Float(finite_rim), mi.Float(law.theta_max)
            self.coefficients = [mi.Float(k) for k in coefficients]
            # Opaque, so that one kernel serves all poses, regions and cameras of a lens.
            dr.make_opaque(self.scale, self.shift, self.rotation, self.origin, self.rho_max, self.theta_max)
            dr.make_opaque(self.coefficients)
            self.m_needs_sample_2 = True

        def sample_ray(self, time: Any, sample1: Any, sample2: Any, sample3: Any, active: Any = True) -> Any:
            image = sample2 * self.scale + self.shift
            radius = dr.norm(image)
            seen = radius <= self.rho_max
            sine, cosine = _sine_cosine(dr, mi, self, dr.minimum(radius, self.rho_max))
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
            return f"Fisheye[{self.law}]"

    mi.register_sensor(SENSOR, Fisheye)


def _sine_cosine(dr: Any, mi: Any, sensor: Any, rho: Any) -> tuple[Any, Any]:
    """sin and cos of theta(rho), each in the form that loses least in float32."""
    if sensor.law == "orthogonal":
        return rho, dr.safe_sqrt((1.0 - rho) * (1.0 + rho))
    if sensor.law == "perspective":
        cosine = dr.rsqrt(1.0 + rho * rho)
        return rho * cosine, cosine
    if sensor.law == "equidistance":
        return dr.sincos(rho)
    if sensor.law == "equisolid":
        half = 0.5 * rho  # sin(theta / 2)
        return 2.0 * half * dr.safe_sqrt((1.0 - half) * (1.0 + half)), 1.0 - 2.0 * half * half
    if sensor.law == "stereographic":
        half = 0.5 * rho  # tan(theta / 2)
        scale = 1.0 / (1.0 + half * half)
        return 2.0 * half * scale, (1.0 - half) * (1.0 + half) * scale
    assert sensor.law == KANNALA_BRANDT
    return dr.sincos(_invert_polynomial(dr, mi, sensor, rho))


def _invert_polynomial(dr: Any, mi: Any, sensor: Any, rho: Any) -> Any:
    """theta of the Kannala-Brandt polynomial: Newton's method kept inside a shrinking bracket."""
    k1, k2, k3, k4 = sensor.coefficients
    low, high = mi.Float(0.0), mi.Float(sensor.theta_max)
    theta = dr.minimum(rho, sensor.theta_max)
    for _ in range(INVERSION_STEPS):
        t2 = theta * theta
        value = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
        slope = 1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)))
        excess = value - rho
        low, high = dr.select(excess < 0.0, theta, low), dr.select(excess >= 0.0, theta, high)
        proposal = theta - excess / slope
        theta = dr.select((proposal >= low) & (proposal <= high), proposal, 0.5 * (low + high))
    return theta
