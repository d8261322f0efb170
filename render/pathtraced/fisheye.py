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
    DeviceMatrix3,
    DevicePoint2,
    DevicePoint3,
    DeviceRay,
    DeviceRayDifferential,
    DeviceSpectrum,
    DeviceVector3,
)
from render.lens_law import DeviceLens, device_lens, incidence_angle
from render.motion import RollingPose
from render.pupil import Pupil, pupil_place
from render.targets.image_region import Region

SENSOR = "eposit_fisheye"
HALF_PIXEL = 0.5
ROW_NUMBERS = 12  # nine of a rotation, three of an origin
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
        sensor.rows = _row_placements(cam_from_obj, tile, world_from_obj)
    if pupil is not None:
        sensor.open_pupil(pupil)
    return sensor


def _row_placements(cam_from_obj: RollingPose, tile: Region, world_from_obj: Array) -> DeviceFloat:
    """ROW_NUMBERS numbers for each row of a tile: rotation and origin of the scene's frame from the camera's.

    A tile's rows below the picture have the poses of a longer picture; nobody sees them.
    """
    obj_from_cam = cam_from_obj.at_rows(np.arange(tile.y, tile.y + tile.height)).inverse()
    rotation = world_from_obj[:3, :3] @ obj_from_cam.R
    origin = obj_from_cam.t @ world_from_obj[:3, :3].T + world_from_obj[:3, 3]
    table = np.concatenate((rotation.reshape(-1, 9), origin), axis=1)
    return backend.upload(table.ravel())


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


def _direction(law: DeviceLens, image: DevicePoint2) -> tuple[DeviceVector3, DeviceBool]:
    """Directions of rays in camera axes through normalised image coordinates, and whether the lens sees them."""
    mi, dr = backend.load(), backend.jit()
    rho = dr.norm(image)
    theta = incidence_angle(law, dr.minimum(rho, law.rho_max))
    side = dr.select(rho > 0.0, theta.sine / rho, 1.0)  # on the axis both coordinates are 0
    return mi.Vector3f(image.x * side, image.y * side, theta.cosine), rho <= law.rho_max


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
            self.law = device_lens(props["lens"], coefficients)
            focal, centre = ((props[x], props[y]) for x, y in (("fx", "fy"), ("cx", "cy")))
            scale, shift = _image_from_film(self.film().crop_size(), self.film().crop_offset(), focal, centre)
            self.scale, self.shift = mi.Vector2f(scale), mi.Vector2f(shift)
            self.rotation, self.origin = mi.Matrix3f(to_world[:3, :3]), mi.Point3f(to_world[:3, 3])
            # Opaque, so that one kernel serves all poses, regions and cameras of a lens.
            dr.make_opaque(self.scale, self.shift, self.rotation, self.origin)
            self.rows: DeviceFloat | None = None  # a placement for each row of the film, under a rolling shutter
            self.pupil: list[DeviceFloat] | None = None  # radius, mm, and 1 / focus distance
            self.m_needs_sample_2 = True

        def sample_ray(
            self,
            time: DeviceFloat,
            sample1: DeviceFloat,
            sample2: DevicePoint2,
            sample3: DevicePoint2,
            active: DeviceBool | bool = True,
        ) -> tuple[DeviceRay, DeviceSpectrum]:
            direction, seen = _direction(self.law, sample2 * self.scale + self.shift)
            rotation, origin = self.placement(sample2.y)
            if self.pupil is not None:
                disc = mi.warp.square_to_uniform_disk_concentric(sample3) * self.pupil[0]
                place = mi.Vector3f(*pupil_place((direction.x, direction.y, direction.z), (disc.x, disc.y)))
                direction, origin = direction - place * self.pupil[1], origin + rotation @ place
            ray = dr.zeros(mi.Ray3f, dr.width(direction))
            ray.o, ray.d, ray.time = mi.Point3f(origin), dr.normalize(rotation @ direction), time
            ray.maxt = dr.select(seen, dr.largest(mi.Float), 0.0)
            # A kernel of its own, so that the large one that traces the rays is compiled once for all lenses.
            dr.eval(ray, seen)
            return ray, dr.select(seen, mi.Spectrum(1.0), mi.Spectrum(0.0))

        def open_pupil(self, pupil: Pupil) -> None:
            """See through an open pupil from now on."""
            self.pupil = [dr.opaque(mi.Float, value) for value in (pupil.radius_mm, 1.0 / pupil.focus_mm)]
            self.m_needs_sample_3 = True

        def placement(self, down: DeviceFloat) -> tuple[DeviceMatrix3, DevicePoint3]:
            """Rotation and origin at the time of the row that lies at a height of the film, from 0 to 1."""
            if self.rows is None:
                return self.rotation, self.origin
            rows = dr.width(self.rows) // ROW_NUMBERS
            row = dr.clip(dr.floor(down * rows), 0.0, rows - 1.0)
            numbers = [dr.gather(mi.Float, self.rows, mi.UInt32(row) * ROW_NUMBERS + i) for i in range(ROW_NUMBERS)]
            return mi.Matrix3f(*numbers[:9]), mi.Point3f(*numbers[9:])

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
