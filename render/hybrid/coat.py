"""A board's surface taken apart: the paint below, which reflects evenly, and the shiny layer above it.

Mitsuba's plastics are the sum of both, linear in the paint's reflectance. The paint's light passes the layer's surface
on its way out, and less of it does at grazing angles.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any  # Any: Mitsuba describes materials by dictionaries of mixed values

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from eposit.arrays import Array
from render import backend
from render.motion import RollingPose
from render.targets.image_region import Region

ANGLES = 512  # cosines at which the layer's transmission is tabulated
WHITE, NONE = ({"type": "rgb", "value": [value] * 3} for value in (1.0, 0.0))


@dataclass(frozen=True, slots=True, eq=False)
class Coat:
    """The parts of a surface."""

    paint: Any  # BSDF of white paint below the layer
    gloss: Any | None  # BSDF of the layer alone; None for a matt surface
    transmission: Array  # (ANGLES,) light of the paint at cosines from 0 to 1 to the normal, by that along the normal

    def transmitted(self, camera: Camera, cam_from_obj: Pose, region: Region) -> NDArray[np.float32]:
        """(height, width) `transmission` at a region's pixels, for a board in the plane z = 0."""
        if self.gloss is None:
            return np.ones((region.height, region.width), np.float32)
        rows, columns = np.mgrid[region.pixels]
        bearings = camera.bearing(np.stack((columns, rows), axis=-1).reshape(-1, 2).astype(float))
        if isinstance(cam_from_obj, RollingPose):
            along_normal = np.sum(bearings * cam_from_obj.at_rows(rows.ravel()).R[..., 2], axis=-1)
        else:
            along_normal = bearings @ cam_from_obj.R[:, 2]
        cosine = np.nan_to_num(np.abs(along_normal))
        found = np.interp(cosine, np.linspace(0.0, 1.0, ANGLES), self.transmission)
        return found.reshape(region.height, region.width).astype(np.float32)


def coat(material: dict[str, Any]) -> Coat:
    """Take a Mitsuba description of a board's surface apart; its paint's reflectance does not matter."""
    mi = backend.load()
    if material["type"] == "diffuse":
        return Coat(matt_white(), None, np.ones(ANGLES))
    paint = mi.load_dict({**material, "diffuse_reflectance": WHITE, "specular_reflectance": NONE})
    gloss = mi.load_dict({**material, "diffuse_reflectance": NONE})
    return Coat(paint, gloss, _transmission(paint))


def matt_white() -> Any:
    """BSDF of white paint without a layer."""
    return backend.load().load_dict({"type": "diffuse", "reflectance": WHITE})


def _transmission(paint: Any) -> Array:
    mi, dr = backend.load(), backend.jit()
    cosine = dr.linspace(mi.Float, 1e-4, 1.0, ANGLES)
    surface = dr.zeros(mi.SurfaceInteraction3f, ANGLES)
    surface.wi = mi.Vector3f(dr.sqrt(1.0 - cosine * cosine), 0.0, cosine)
    value = np.array(paint.eval(mi.BSDFContext(), surface, mi.Vector3f(0.0, 0.0, 1.0)), np.float64)[0]
    return value / value[-1]
