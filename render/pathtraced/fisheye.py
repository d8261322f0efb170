"""The fish-eye sensor plugin: one for all lenses, by exact per-ray inverse projection.

It is what makes Mitsuba's own integrators see through our lenses: they are the reference for `render.analytic`.
Only here are pixel coordinates shifted by half a pixel: Mitsuba's pixel i covers [i, i + 1), OpenCV's centre is i.
"""

from __future__ import annotations

import functools
from typing import Any  # Any: Mitsuba describes a sensor by dictionaries of mixed values

import numpy as np

from eposit import Camera, Pose
from eposit.arrays import Array
from eposit.calibrated_lens import MOST_COEFFICIENTS
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
from render.lens_law import device_lens
from render.motion import RollingPose
from render.pathtraced.film_rays import FilmRays, row_placements
from render.pupil import Pupil
from render.targets.image_region import Region

SENSOR = "eposit_fisheye"
HALF_PIXEL = 0.5
CROP = ("offset_x", "offset_y", "width", "height")  # of a film, in the order of a Region


def sensor_dict(camera: Camera, cam_from_obj: Pose, region: Region, samples: int) -> dict[str, Any]:
    """Mitsuba description of `camera` at a pose, for a region of its picture.

    cam_from_obj: the pose; the object frame is the world frame.
    Raises:
        BackendError: Mitsuba cannot run here.
    """
    crop = {f"crop_{name}": value for name, value in zip(CROP, region, strict=True)}
    film = _film(camera.width, camera.height, "luminance_alpha") | crop
    return _description(camera, cam_from_obj, film, samples, np.eye(4))


def tile_sensor(
    camera: Camera, cam_from_obj: Pose, tile: Region, samples: int, world_from_obj: Array, pupil: Pupil | None = None
) -> Any:
    """Mitsuba's sensor for a tile of the picture, with a film of the tile's size in RGBA and no crop.

    world_from_obj: (4, 4) from the object frame, mm, to the scene's frame and units. pupil: None for a pinhole.
    """
    shifted = camera.replace(cx=camera.cx - tile.x, cy=camera.cy - tile.y, width=tile.width, height=tile.height)
    film = _film(tile.width, tile.height, "rgba")
    sensor = backend.load().load_dict(_description(shifted, cam_from_obj, film, samples, world_from_obj))
    if isinstance(cam_from_obj, RollingPose):
        sensor.film_rays.rows = row_placements(cam_from_obj, tile, world_from_obj)
    if pupil is not None:
        sensor.film_rays.open_pupil(pupil)
        sensor.m_needs_sample_3 = True
    return sensor


def _description(
    camera: Camera, cam_from_obj: Pose, film: dict[str, Any], samples: int, world_from_obj: Array
) -> dict[str, Any]:
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
        "to_world": mi.ScalarTransform4f(world_from_obj @ to_world),
        "film": film,
        "sampler": {"type": "multijitter", "sample_count": samples},
    }


def _film(width: int, height: int, pixel_format: str) -> dict[str, Any]:
    return {
        "type": "hdrfilm",
        "width": width,
        "height": height,
        "pixel_format": pixel_format,
        "component_format": "float32",
        "rfilter": {"type": "box"},
    }


def _image_from_film(size: Any, offset: Any, focal: tuple[float, float], centre: tuple[float, float]) -> list[Array]:
    """(2,) scale and (2,) shift from positions in [0, 1] of a film's crop to normalised image coordinates.

    size, offset: of the crop, px; Any: Mitsuba's integer vectors, which NumPy reads. focal, centre: px. In double
    precision: at 1600 px a float32 coordinate is only good to 1e-4 px.
    """
    return [np.array(size) / focal, (np.array(offset) - HALF_PIXEL - centre) / focal]


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
            coefficients = tuple(props[f"k{i}"] for i in range(1, 1 + MOST_COEFFICIENTS) if f"k{i}" in props)
            to_world = np.array(props["to_world"].matrix, dtype=np.float64)
            focal, centre = ((props[x], props[y]) for x, y in (("fx", "fy"), ("cx", "cy")))
            scale, shift = _image_from_film(self.film().crop_size(), self.film().crop_offset(), focal, centre)
            law = device_lens(props["lens"], coefficients)
            place = mi.Matrix3f(to_world[:3, :3]), mi.Point3f(to_world[:3, 3])
            self.film_rays = FilmRays(law, mi.Vector2f(scale), mi.Vector2f(shift), *place)
            # Opaque, so that one kernel serves all poses, regions and cameras of a lens.
            dr.make_opaque(self.film_rays.scale, self.film_rays.shift, *place)
            self.m_needs_sample_2 = True

        def sample_ray(
            self,
            time: DeviceFloat,
            sample1: DeviceFloat,
            sample2: DevicePoint2,
            sample3: DevicePoint2,
            active: DeviceBool | bool = True,
        ) -> tuple[DeviceRay, DeviceSpectrum]:
            origin, direction, seen = self.film_rays.through(sample2, sample3)
            ray = dr.zeros(mi.Ray3f, dr.width(direction))
            ray.o, ray.d, ray.time = origin, direction, time
            ray.maxt = dr.select(seen, dr.largest(mi.Float), 0.0)
            # A kernel of its own, so that the large one that traces the rays is compiled once for all lenses.
            dr.eval(ray, seen)
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
            return f"Fisheye[{self.film_rays.law.name}]"

    mi.register_sensor(SENSOR, Fisheye)
