"""One frame in linear light: rendered in the region that the target can touch, computed everywhere else.

Radiance 1 is the white board at its centre, or on the mean where a world lights it. In the studio only background and
the lens's image circle remain outside the region, and those need no rays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from eposit import Camera, Pose
from eposit.arrays import Mask
from render import backend
from render.analytic.image_circle import lens_coverage
from render.analytic.integrate import integrate_region
from render.colour import luminance
from render.device import DeviceScene
from render.hybrid.bake import BakedLight
from render.hybrid.picture import HybridScene
from render.hybrid.prepare import baked_light, hybrid_scene
from render.light import Light
from render.pathtraced.fisheye import sensor_dict
from render.pathtraced.picture import Viewpoint, prepared, trace_picture
from render.pathtraced.scene import reference_scene
from render.region import Image, target_region
from render.targets.image_region import Region
from render.targets.kinds import AnyTarget
from render.truth.pixels import PixelTruth, pixel_truth
from render.truth.visibility import visible_points
from render.world import World, WorldDraw
from render.world.boards import BOARD
from render.world.compose import Composition

REFERENCE_RAYS = 1 << 24  # in flight while the reference is traced


@dataclass(frozen=True, slots=True)
class LinearImage:
    """Linear radiance of a region and of the rest, in grey or in RGB."""

    radiance: Image  # (height, width) or (height, width, 3) of the region
    region: Region
    background: float | Image  # radiance behind the board; or the whole picture, the region among it

    @property
    def in_colour(self) -> bool:
        """Whether it is RGB."""
        return self.radiance.ndim == 3

    def full(self, camera: Camera) -> Image:
        """(camera.height, camera.width) or (..., 3) radiance of the whole picture."""
        if isinstance(self.background, np.ndarray):
            return self.background.copy()
        picture = (self.background * lens_coverage(camera)).astype(np.float32)
        if self.in_colour:
            picture = np.repeat(picture[..., None], 3, axis=2)
        picture[self.region.pixels] = self.radiance
        return picture


def render_world(
    world: World,
    draw: WorldDraw,
    target: AnyTarget,
    light: Light,
    view: Viewpoint,
    *,
    samples: int,
    in_colour: bool,
    baked: BakedLight | None = None,
) -> LinearImage:
    """Render one frame of a world in linear light, by the world's method.

    samples: of the closed form, as for `render_frame`. baked: the world's light for the method hybrid; baked here if
    it is left out.

    Raises:
        ValueError: the target's image lies outside the picture, no light reaches it, or the user's scene cannot be
            used.
    """
    if world.method == "closed":
        grey = render_frame(target, light, view.camera, view.cam_from_obj, samples=samples)
        return replace(grey, radiance=np.repeat(grey.radiance[..., None], 3, axis=2)) if in_colour else grey
    if world.method == "hybrid":
        baked = baked_light(world, draw, target, light) if baked is None else baked
        return _hybrid(hybrid_scene(world, draw, target, light, baked), view, samples, in_colour)
    near = target_region(target, view.camera, view.cam_from_obj)
    if world.surround == "studio":  # beyond the target there is nothing but the background
        film = trace_picture(world, draw, target, light, view, near, near)
        behind = np.maximum(lens_coverage(view.camera)[near.pixels] - film[..., 3], 0.0)
        radiance = film[..., :3] + (np.float32(light.background) * behind)[..., None]
        return LinearImage(_grey_or_colour(radiance, in_colour), near, light.background)
    whole = Region.whole(view.camera.width, view.camera.height)
    film = trace_picture(world, draw, target, light, view, near, whole)
    picture = _grey_or_colour(film[..., :3], in_colour)
    return LinearImage(picture[near.pixels], near, picture)


def _hybrid(scene: HybridScene, view: Viewpoint, samples: int, in_colour: bool) -> LinearImage:
    near = target_region(scene.target, view.camera, view.cam_from_obj)
    radiance = scene.region(view.camera, view.cam_from_obj, near, cells=samples, seed=view.seed)
    if scene.empty_radiance is not None:
        return LinearImage(_grey_or_colour(radiance, in_colour), near, scene.empty_radiance)
    whole = scene.surroundings(view.camera, view.cam_from_obj, near, seed=view.seed)
    whole[near.pixels] = radiance
    picture = _grey_or_colour(whole, in_colour)
    return LinearImage(picture[near.pixels], near, picture)


@dataclass(frozen=True, slots=True)
class FrameTruth:
    """Truth of one frame, traced when it is asked for."""

    scene: DeviceScene
    composition: Composition
    target: AnyTarget
    camera: Camera
    cam_from_obj: Pose

    def visible(self) -> Mask:
        """(n,) whether the camera sees each point of the target."""
        has_target = BOARD in self.composition.objects
        place = self.composition.world_from_obj, self.target.points, self.camera, self.cam_from_obj
        return visible_points(self.scene, *place, has_target=has_target)

    def pixels(self) -> PixelTruth:
        """Depth, range, normal and object of every pixel."""
        place = self.composition.world_from_obj, self.composition.names, self.camera, self.cam_from_obj
        return pixel_truth(self.scene, *place)


def truth_of(
    world: World, draw: WorldDraw, target: AnyTarget, light: Light, camera: Camera, cam_from_obj: Pose
) -> FrameTruth:
    """The truth of one frame, by rays in the scene that its picture shows.

    Raises:
        ValueError: no light reaches the target, or the user's file cannot be used.
    """
    tracer, _ = prepared(world, draw, target, light)
    return FrameTruth(tracer.scene, tracer.composition, target, camera, cam_from_obj)


def _grey_or_colour(rgb: Image, in_colour: bool) -> Image:
    return np.ascontiguousarray(rgb, np.float32) if in_colour else luminance(rgb)


def render_frame(
    target: AnyTarget,
    light: Light,
    camera: Camera,
    cam_from_obj: Pose,
    *,
    samples: int,
    region: Region | None = None,
) -> LinearImage:
    """Render one frame in linear light, float32, box filter, by closed forms: without random numbers.

    samples: cells of a pixel that edges cross, a square number. region: pixels to render, by default the target's.
    """
    region = target_region(target, camera, cam_from_obj) if region is None else region
    radiance = integrate_region(target, light, camera, cam_from_obj, region, samples)
    return LinearImage(radiance, region, light.background)


def render_reference(
    target: AnyTarget,
    light: Light,
    camera: Camera,
    cam_from_obj: Pose,
    *,
    samples: int,
    seed: int,
    region: Region | None = None,
) -> LinearImage:
    """The same frame by Mitsuba's direct light, with `samples` multijittered rays for every pixel.

    seed: of the rays, 32 bits.
    """
    region = target_region(target, camera, cam_from_obj) if region is None else region
    film = _path_traced(reference_scene(target, light), camera, cam_from_obj, region, samples, seed)
    behind = np.maximum(lens_coverage(camera)[region.pixels] - film[..., 1], 0.0)
    radiance = film[..., 0] + np.float32(light.background) * behind
    return LinearImage(radiance.astype(np.float32), region, light.background)


def _path_traced(
    scene: DeviceScene, camera: Camera, cam_from_obj: Pose, region: Region, samples: int, seed: int
) -> Image:
    """(height, width, 2) radiance and share of hits by Mitsuba, a band of rows at a time to bound the memory."""
    mi = backend.load()
    rows = max(1, REFERENCE_RAYS // (region.width * samples))
    bands: list[Image] = []
    for top in range(region.y, region.y + region.height, rows):
        band = Region(region.x, top, region.width, min(rows, region.y + region.height - top))
        sensor = mi.load_dict(sensor_dict(camera, cam_from_obj, band, samples))
        keyed = (seed + top) & 0xFFFFFFFF  # no two bands share their random numbers
        bands.append(np.array(mi.render(scene, sensor=sensor, spp=samples, seed=keyed)))
    return np.concatenate(bands)
