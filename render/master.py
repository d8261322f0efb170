"""One frame in linear light: rendered in the region that the target can touch, computed everywhere else.

Radiance 1 is the white board at its centre. Outside the region only background and the lens's image circle remain,
and those need no rays.
"""

from __future__ import annotations

import functools
import io
import os
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from eposit.arrays import Array, Mask
from render import backend
from render.light import Light, shade_radius
from render.scene import lookup_scene, reference_scene
from render.sensor import sensor_dict
from render.target import Target
from render.trace import trace

Image = NDArray[np.float32]
Region = tuple[int, int, int, int]  # x, y, width, height, px
REGION_MARGIN = 8  # px around the target's outline; a point spread of 1.5 px needs 6
EDGE_MARGIN = 1  # px around a traced edge: rounding and the half-pixel steps stay within it
SMOOTH_SAMPLES = 4  # rays for a pixel without an edge: shading bends too little within a pixel for more
RIM_SAMPLES = 16  # subpixels along each side on the image circle's rim


class MasterError(ValueError):
    """A master that cannot be read; the message names the file and the remedy."""


@dataclass(frozen=True, slots=True)
class Master:
    """Linear radiance of a region and of the rest."""

    radiance: Image  # (height, width) of the region
    region: Region
    background: float  # radiance behind the board

    def full(self, camera: Camera) -> Image:
        """(camera.height, camera.width) radiance of the whole picture."""
        picture = (self.background * lens_coverage(camera)).astype(np.float32)
        x, y, width, height = self.region
        picture[y : y + height, x : x + width] = self.radiance
        return picture


def target_region(target: Target, camera: Camera, cam_from_obj: Pose, margin: int = REGION_MARGIN) -> Region:
    """The smallest rectangle of the picture that holds the target's image and a margin.

    Raises:
        ValueError: the target has no image, or none inside the picture.
    """
    outline = camera.project(cam_from_obj.apply(target.outline()))
    if np.any(np.isnan(outline)):
        return 0, 0, camera.width, camera.height  # part of the board is beyond the lens: it may reach anywhere
    low = np.floor(outline.min(axis=0)).astype(int) - margin
    high = np.ceil(outline.max(axis=0)).astype(int) + margin + 1
    low, high = np.maximum(low, 0), np.minimum(high, (camera.width, camera.height))
    if np.any(high <= low):
        raise ValueError("the target's image lies outside the picture; move the target or the camera")
    return int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1])


def render_master(
    target: Target,
    light: Light,
    camera: Camera,
    cam_from_obj: Pose,
    *,
    samples: int,
    seed: int,
    region: Region | None = None,
    reference: bool = False,
) -> Master:
    """Render one frame in linear light, float32, box filter.

    samples: rays per pixel, a square number (multijittered). seed: 32 bits; the same seed gives the same bits.
    region: pixels to render, by default the target's. reference: Mitsuba's direct light instead of the looked-up one.
    """
    region = target_region(target, camera, cam_from_obj) if region is None else region
    x, y, width, height = region
    film = _film(target, light, camera, cam_from_obj, region, samples, seed, reference)
    behind = lens_coverage(camera)[y : y + height, x : x + width] - film[..., 1]
    radiance = film[..., 0] + np.float32(light.background) * np.maximum(behind, 0.0)
    return Master(radiance.astype(np.float32), region, light.background)


def _film(
    target: Target,
    light: Light,
    camera: Camera,
    cam_from_obj: Pose,
    region: Region,
    samples: int,
    seed: int,
    reference: bool,
) -> Image:
    """(height, width, 2) radiance and share of hits in the region."""
    mi = backend.load()
    if reference:
        sensor = mi.load_dict(sensor_dict(camera, cam_from_obj, region, samples))
        return np.array(mi.render(reference_scene(target, light), sensor=sensor, spp=samples, seed=seed & 0xFFFFFFFF))
    whole = (0, 0, camera.width, camera.height)
    sensor = mi.load_dict(sensor_dict(camera, cam_from_obj, whole, samples))
    x, y, width, height = region
    edges = edge_pixels(target, light, camera, cam_from_obj, region).ravel()
    column, row = np.meshgrid(np.arange(x, x + width), np.arange(y, y + height))
    pixels = (row * camera.width + column).astype(np.uint32).ravel()
    film = np.empty((len(pixels), 2), np.float32)
    for chosen, count in ((edges, samples), (~edges, min(samples, SMOOTH_SAMPLES))):
        picture = (camera.width, camera.height)
        film[chosen] = trace(lookup_scene(target, light), sensor, pixels[chosen], picture, count, seed)
    return film.reshape(height, width, 2)


def edge_pixels(target: Target, light: Light, camera: Camera, cam_from_obj: Pose, region: Region) -> Mask:
    """(height, width) pixels of the region where brightness jumps or bends: edges of the target, the circle's shade.

    Pixels on the rim of the lens's image circle count too. Edges are followed in steps of at most half a pixel.
    """
    x, y, width, height = region
    mask = np.zeros((height + 2 * EDGE_MARGIN, width + 2 * EDGE_MARGIN), bool)
    for line in [*target.edges(), *_shade_rings(target, light, camera, cam_from_obj)]:
        pixels = _dense(camera, cam_from_obj, line)
        if pixels is None:
            return np.ones((height, width), bool)  # part of the target is beyond the lens: no map of its edges
        column, row = (np.rint(pixels) - (x, y)).astype(int).T + EDGE_MARGIN
        inside = (column >= 0) & (column < mask.shape[1]) & (row >= 0) & (row < mask.shape[0])
        mask[row[inside], column[inside]] = True
    grown = np.zeros_like(mask)
    for dy in range(-EDGE_MARGIN, EDGE_MARGIN + 1):
        for dx in range(-EDGE_MARGIN, EDGE_MARGIN + 1):
            grown |= np.roll(mask, (dy, dx), axis=(0, 1))
    coverage = lens_coverage(camera)[y : y + height, x : x + width]
    inner = grown[EDGE_MARGIN : EDGE_MARGIN + height, EDGE_MARGIN : EDGE_MARGIN + width]
    return inner | ((coverage > 0.0) & (coverage < 1.0))


def _shade_rings(target: Target, light: Light, camera: Camera, cam_from_obj: Pose) -> list[Array]:
    """Circles (n, 3), mm, on the board that cover the circle's shade, less than a pixel apart."""
    foot = target.circle_centre * (1.0, 1.0, 0.0)
    radius = shade_radius(target, light)
    border = foot + (target.circle_rim() - target.circle_centre) * (radius / target.circle_radius_mm)
    outer, middle = (camera.project(cam_from_obj.apply(points)) for points in (border, foot[None]))
    span = np.linalg.norm(outer - middle, axis=1)
    if np.any(np.isnan(span)):
        return []
    shares = np.linspace(0.0, 1.0, int(1.5 * span.max()) + 2)[1:]
    closed = np.vstack((border, border[:1]))
    return [foot + share * (closed - foot) for share in shares]


def _dense(camera: Camera, cam_from_obj: Pose, line: Array) -> Array | None:
    """(n, 2) px along an edge, at most half a pixel apart; None where the lens does not see all of it."""
    at, pixels = np.linspace(0.0, len(line) - 1.0, len(line)), None
    for _ in range(2):
        points = np.stack([np.interp(at, np.arange(len(line)), column) for column in line.T], axis=1)
        pixels = camera.project(cam_from_obj.apply(points))
        if np.any(np.isnan(pixels)):
            return None
        gap = float(np.linalg.norm(np.diff(pixels, axis=0), axis=1).max())
        at = np.linspace(0.0, len(line) - 1.0, int(len(at) * max(1.0, 2.5 * gap)) + 1)
    return pixels


@functools.lru_cache(maxsize=8)
def lens_coverage(camera: Camera) -> Image:
    """(height, width) share of each pixel that the lens sees: 1 inside the image circle, 0 outside."""
    rim = camera.law.rho_max
    corner = np.hypot((camera.width + abs(camera.cx)) / camera.fx, (camera.height + abs(camera.cy)) / camera.fy)
    if not np.isfinite(rim) or rim >= corner:
        return np.ones((camera.height, camera.width), np.float32)
    x, y = (np.arange(camera.width) - camera.cx) / camera.fx, (np.arange(camera.height) - camera.cy) / camera.fy
    radius = np.hypot(x[None], y[:, None])
    coverage = (radius <= rim).astype(np.float32)
    pixel = 1.0 / min(camera.fx, camera.fy)
    rows, columns = np.nonzero(np.abs(radius - rim) <= pixel)
    sub = (np.arange(RIM_SAMPLES) + 0.5) / RIM_SAMPLES - 0.5
    fine_x = x[columns, None, None] + sub[None, None, :] / camera.fx
    fine_y = y[rows, None, None] + sub[None, :, None] / camera.fy
    coverage[rows, columns] = np.mean(np.hypot(fine_x, fine_y) <= rim, axis=(1, 2))
    return coverage


def write_master(master: Master, camera: Camera, path: Path, key: str = "") -> None:
    """EXR with the region as data window inside the picture as display window; atomic, lossless.

    key: what the master was made from, for `read_master` to compare.
    """
    import OpenEXR

    from render.files import replace_atomically

    x, y, width, height = master.region
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "dataWindow": (np.array([x, y], np.int32), np.array([x + width - 1, y + height - 1], np.int32)),
        "displayWindow": (np.array([0, 0], np.int32), np.array([camera.width - 1, camera.height - 1], np.int32)),
        "background": float(master.background),
        "key": key,
    }
    with replace_atomically(path) as temporary, OpenEXR.File(header, {"Y": master.radiance}) as file:
        file.write(str(temporary))


def read_master(path: Path, key: str = "") -> Master:
    """The master in an EXR file.

    Raises:
        MasterError: the file is missing, truncated, not one of ours, or made from something else than `key`.
    """
    import OpenEXR

    if not path.is_file():
        raise MasterError(f"{path} is missing; run the generate stage again to render it")
    try:
        with _silent_library(), OpenEXR.File(str(path)) as file:
            header, channels = file.header(), file.channels()
            if header["key"] != key:
                raise MasterError(
                    f"{path} belongs to another frame or recipe; delete it and run the generate stage again"
                )
            (low, high), radiance = header["dataWindow"], channels["Y"].pixels
            region = (int(low[0]), int(low[1]), int(high[0] - low[0] + 1), int(high[1] - low[1] + 1))
            return Master(np.array(radiance, np.float32), region, float(header["background"]))
    except MasterError:
        raise
    except (ValueError, RuntimeError, KeyError, OSError) as error:
        raise MasterError(f"{path} cannot be read as a master; delete it and run the generate stage again") from error


@contextmanager
def _silent_library() -> Iterator[None]:
    """Nothing is printed: OpenEXR's library writes what it raises to descriptor 2, its Python binding to sys.stdout."""
    kept = os.dup(2)
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        with redirect_stdout(io.StringIO()):
            yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
