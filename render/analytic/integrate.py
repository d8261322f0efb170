"""The light of a region of the picture: a cell for each pixel, and a grid of cells where edges cross a pixel.

Without edges shading is smooth, and one cell gives a pixel's mean. There is no noise and no random number: a pixel's
value follows from its place in the picture, so that a region has the bits of the whole picture.

Nothing that changes from frame to frame is a literal of a kernel: three kernels serve all poses, regions and cameras
of a lens.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from render import backend
from render.analytic.board_reflectance import MANY_EDGES, ONE_EDGE, SMOOTH
from render.analytic.cells import sample_cells
from render.analytic.device_print import DevicePrint
from render.analytic.device_target import DeviceTarget, device_scene
from render.analytic.image_circle import device_coverage
from render.analytic.rays import DeviceCamera, device_camera
from render.device import DeviceBool, DeviceFloat, DeviceIndex, DeviceInt
from render.light import Light
from render.motion import points_in_cam
from render.pupil import Pupil
from render.targets.image_region import Region
from render.targets.kinds import AnyTarget

CHUNK = 1 << 23  # cells in flight; a cell takes 8 bytes
ONE_EDGE_CELLS = 4  # a single straight edge needs one cell; four follow its bend and the light along it


def integrate_region(
    target: AnyTarget,
    light: Light,
    camera: Camera,
    cam_from_obj: Pose,
    region: Region,
    samples: int,
    pupil: Pupil | None = None,
) -> NDArray[np.float32]:
    """(height, width) mean radiance of the pixels of a region.

    samples: cells of a pixel that several edges cross, a square number. pupil: the mean over its places, each of which
    sees a sharp picture.

    Raises:
        ValueError: the target is too far out of focus.
    """
    uploaded = device_scene(target, light)

    def through(place: tuple[float, float, float] | None) -> NDArray[np.float32]:
        seen = device_camera(camera, cam_from_obj, place)
        return integrate_shaded(uploaded, seen, camera, region, samples, light.background)

    if pupil is None:
        return through(None)
    blur_px = pupil.blur_radius_px(camera, points_in_cam(camera, cam_from_obj, target.outline()))
    total = np.zeros((region.height, region.width), np.float32)
    for place, weight in pupil.places(blur_px):
        total += np.float32(weight) * through((*place, pupil.focus_mm))
    return total


def integrate_shaded(
    target: DeviceTarget | DevicePrint,
    device_camera: DeviceCamera,
    camera: Camera,
    region: Region,
    samples: int,
    background: float,
    divided: NDArray[np.bool_] | None = None,
) -> NDArray[np.float32]:
    """(height, width) mean radiance of the pixels of a region, of a target under any map of light.

    device_camera: `camera` at its pose. divided: (height, width) pixels to divide into cells even where no edge of the
    target crosses them, for shadows with an edge.
    """
    mi, dr = backend.load(), backend.jit()
    scene = target, device_camera
    radiance_behind = dr.opaque(mi.Float, background)
    place = _DeviceRegion(*(dr.opaque(mi.Int32, value) for value in region[:3]))
    centres = place.pixel_centres(dr.arange(mi.Int32, region.width * region.height))
    seen = _lens_coverage(camera, *centres)
    found = sample_cells(*scene, *centres, mi.Float(1.0))
    picture = found.radiance + radiance_behind * dr.maximum(seen - found.filled, 0.0)
    edges = dr.select((seen > 0.0) & (seen < 1.0), MANY_EDGES, dr.select(seen > 0.0, found.edges, SMOOTH))
    if divided is not None:
        edges = dr.select(backend.upload(divided.ravel().astype(np.uint32)) != 0, MANY_EDGES, edges)
    dr.eval(picture, edges, seen)
    for kind, cells in ((ONE_EDGE, min(samples, ONE_EDGE_CELLS)), (MANY_EDGES, samples)):
        for pixels in _chunks(edges == kind, max(1, CHUNK // cells)):
            radiance, filled = _mean_of_cells(*scene, place.pixel_centres(mi.Int32(pixels)), cells)
            behind = dr.maximum(dr.gather(mi.Float, seen, pixels) - filled, 0.0)
            dr.scatter(picture, radiance + radiance_behind * behind, pixels)
    return np.array(picture).reshape(region.height, region.width)


@dataclass(frozen=True, slots=True)
class _DeviceRegion:
    """A region of the picture, uploaded; its pixels are counted row by row."""

    x: DeviceInt
    y: DeviceInt
    width: DeviceInt

    def pixel_centres(self, index: DeviceInt) -> tuple[DeviceFloat, DeviceFloat]:
        """Column and row in the picture of the region's pixels.

        The processor divides floats eight at a time and integers one by one; a float quotient is off by one at most.
        """
        mi, dr = backend.load(), backend.jit()
        row = mi.Int32(mi.Float(index) / mi.Float(self.width))
        column = index - row * self.width
        row += dr.select(column >= self.width, 1, 0) - dr.select(column < 0, 1, 0)
        return mi.Float(index - row * self.width + self.x), mi.Float(row + self.y)


def _lens_coverage(camera: Camera, x_px: DeviceFloat, y_px: DeviceFloat) -> DeviceFloat:
    """Share of pixels that the lens sees."""
    mi, dr = backend.load(), backend.jit()
    index = mi.UInt32(mi.Int32(y_px) * dr.opaque(mi.Int32, camera.width) + mi.Int32(x_px))
    return dr.gather(mi.Float, device_coverage(camera), index)


def _chunks(chosen: DeviceBool, size: int) -> Iterator[DeviceIndex]:
    """Indices of the chosen pixels, at most `size` at a time."""
    mi, dr = backend.load(), backend.jit()
    indices = dr.compress(chosen)
    for begin in range(0, len(indices), size):
        part = dr.arange(mi.UInt32, min(size, len(indices) - begin))
        yield dr.gather(mi.UInt32, indices, part + dr.opaque(mi.UInt32, begin))


def _mean_of_cells(
    target: DeviceTarget | DevicePrint, camera: DeviceCamera, centres: tuple[DeviceFloat, DeviceFloat], cells: int
) -> tuple[DeviceFloat, DeviceFloat]:
    """Mean radiance and mean share of the target of pixels, each divided into `cells`."""
    mi, dr = backend.load(), backend.jit()
    dr.eval(centres)
    side = round(cells**0.5)
    index = dr.arange(mi.UInt32, dr.width(centres) * cells)
    pixel = index // cells
    inner = index - pixel * cells
    row = inner // side
    column = inner - row * side
    size = mi.Float(1.0 / side)
    x_px = dr.gather(mi.Float, centres[0], pixel) + ((mi.Float(column) + 0.5) * size - 0.5)
    y_px = dr.gather(mi.Float, centres[1], pixel) + ((mi.Float(row) + 0.5) * size - 0.5)
    found = sample_cells(target, camera, x_px, y_px, size)
    dr.eval(found.radiance, found.filled)
    # Sums over the contiguous block of a pixel's cells: no atomic additions, the same bits every time.
    radiance, filled = (dr.block_sum(value, cells) * (size * size) for value in (found.radiance, found.filled))
    return radiance, filled
