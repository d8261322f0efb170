"""One frame in linear light: rendered in the region that the target can touch, computed everywhere else.

Radiance 1 is the white board at its centre, or on the mean where a world lights it. In the studio only background and
the lens's image circle remain outside the region, and those need no rays.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from eposit import Camera, Pose
from render import backend
from render.analytic.image_circle import lens_coverage
from render.analytic.integrate import integrate_region
from render.colour import luminance
from render.device import DeviceScene
from render.hybrid.bake import BakedLight
from render.hybrid.prepare import baked_light, hybrid_scene
from render.light import Light
from render.motion import points_in_cam
from render.pathtraced.fisheye import sensor_dict
from render.pathtraced.picture import trace_picture
from render.pathtraced.scene import reference_scene
from render.pathtraced.tiles import Viewpoint
from render.pupil import Pupil
from render.region import REGION_MARGIN, Image, target_region
from render.targets.image_region import Region
from render.targets.kinds import AnyTarget
from render.world import World, WorldDraw

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
    it is left out. Colours with focal lengths of their own are rendered one after another.

    Raises:
        ValueError: the target's image lies outside the picture or too far out of focus, no light reaches it, the user's
            scene cannot be used, the method is hybrid and the lens has an open pupil, or colours have focal lengths of
            their own and the picture is grey.
    """
    if world.method == "hybrid" and view.optics.pupil:
        raise ValueError("method hybrid has sharp edges, which an open pupil blurs by distance; use closed or path")
    scene = _Scene(world, draw, target, light, samples, baked)
    cameras = view.optics.channel_cameras(view.camera)
    near = _near(target, view, cameras)
    if len(cameras) == 1:
        return scene.picture(view, near, in_colour)
    if not in_colour:
        raise ValueError("a focal length for each colour makes pictures in colour only; ask for colour")
    channels: list[Image] = []
    for i, camera in enumerate(cameras):
        picture = scene.picture(replace(view, camera=camera), near, world.method != "closed").full(camera)
        channels.append(picture[..., i] if picture.ndim == 3 else picture)
    whole = np.stack(channels, axis=-1)
    return LinearImage(whole[near.pixels], near, whole)


def _near(target: AnyTarget, view: Viewpoint, cameras: list[Camera]) -> Region:
    """The region that the target can touch in the picture of any of the cameras, with what is out of focus."""
    margin, pupil = REGION_MARGIN, view.optics.pupil
    if pupil is not None:
        outline = points_in_cam(view.camera, view.cam_from_obj, target.outline())
        margin += int(np.ceil(pupil.blur_radius_px(view.camera, outline)))
    regions = [target_region(target, camera, view.cam_from_obj, margin) for camera in cameras]
    low = min(region.x for region in regions), min(region.y for region in regions)
    right, below = (max(region[i] + region[i + 2] for region in regions) for i in (0, 1))
    return Region.between(low, (right, below))


@dataclass(frozen=True, slots=True)
class _Scene:
    """What is rendered, whoever sees it."""

    world: World
    draw: WorldDraw
    target: AnyTarget
    light: Light
    samples: int  # of the closed form
    baked: BakedLight | None

    def picture(self, view: Viewpoint, near: Region, in_colour: bool) -> LinearImage:
        """By the world's method, all colours alike through the view's camera."""
        method = {"closed": self._closed, "hybrid": self._hybrid, "path": self._path}[self.world.method]
        return method(view, near, in_colour)

    def _closed(self, view: Viewpoint, near: Region, in_colour: bool) -> LinearImage:
        place = self.target, self.light, view.camera, view.cam_from_obj
        grey = render_frame(*place, samples=self.samples, region=near, pupil=view.optics.pupil)
        return replace(grey, radiance=np.repeat(grey.radiance[..., None], 3, axis=2)) if in_colour else grey

    def _hybrid(self, view: Viewpoint, near: Region, in_colour: bool) -> LinearImage:
        scenery = self.world, self.draw, self.target, self.light
        scene = hybrid_scene(*scenery, baked_light(*scenery) if self.baked is None else self.baked)
        radiance = scene.region(view.camera, view.cam_from_obj, near, cells=self.samples, seed=view.seed)
        if scene.empty_radiance is not None:
            return LinearImage(_grey_or_colour(radiance, in_colour), near, scene.empty_radiance)
        whole = scene.surroundings(view.camera, view.cam_from_obj, near, seed=view.seed)
        whole[near.pixels] = radiance
        picture = _grey_or_colour(whole, in_colour)
        return LinearImage(picture[near.pixels], near, picture)

    def _path(self, view: Viewpoint, near: Region, in_colour: bool) -> LinearImage:
        scenery = self.world, self.draw, self.target, self.light
        if self.world.surround == "studio":  # beyond the target there is nothing but the background
            film = trace_picture(*scenery, view, near, near)
            behind = np.maximum(lens_coverage(view.camera)[near.pixels] - film[..., 3], 0.0)
            radiance = film[..., :3] + (np.float32(self.light.background) * behind)[..., None]
            return LinearImage(_grey_or_colour(radiance, in_colour), near, self.light.background)
        whole = Region.whole(view.camera.width, view.camera.height)
        film = trace_picture(*scenery, view, near, whole)
        picture = _grey_or_colour(film[..., :3], in_colour)
        return LinearImage(picture[near.pixels], near, picture)


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
    pupil: Pupil | None = None,
) -> LinearImage:
    """Render one frame in linear light, float32, box filter, by closed forms: without random numbers.

    samples: cells of a pixel that edges cross, a square number. region: pixels to render, by default the target's.
    pupil: None for a pinhole.

    Raises:
        ValueError: the target is too far out of focus, or its image lies outside the picture.
    """
    region = target_region(target, camera, cam_from_obj) if region is None else region
    radiance = integrate_region(target, light, camera, cam_from_obj, region, samples, pupil)
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
