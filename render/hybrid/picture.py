"""A hybrid picture: layers in closed form and traced ones, put together."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose
from render.analytic.image_circle import lens_coverage
from render.hybrid.closed_layers import ClosedTarget
from render.hybrid.coat import Coat
from render.hybrid.pixel_rays import RayCamera
from render.hybrid.traced_layers import TracedScene
from render.targets.image_region import Region
from render.targets.kinds import AnyTarget

BLOCKED_MARGIN = 2  # px around what stands in front of the target that are path-traced
BLOCKED_RAYS = 4  # for a pixel, that look for it
Colours = NDArray[np.float32]  # (height, width, 3) linear radiance
Mask = NDArray[np.bool_]  # (height, width)


class Purpose(IntEnum):
    """What random numbers of a frame are for; no two share theirs."""

    GLOSS = 1
    BEHIND = 2
    BLOCKED = 3
    FRONT = 4


@dataclass(frozen=True, slots=True)
class Rays:
    """How many rays a pixel has."""

    layer: int  # of the shiny layer
    background: int
    path: int  # of what stands in front of the target


@dataclass(frozen=True, slots=True, eq=False)
class HybridScene:
    """All that pictures of one scene share."""

    target: AnyTarget
    closed: ClosedTarget
    traced: TracedScene
    coat: Coat
    disc_radiance: NDArray[np.float32]  # (3,)
    rays: Rays
    gain: float  # what radiance is multiplied with
    has_surroundings: bool  # whether anything but the target may be seen

    def frame(self, camera: Camera, cam_from_obj: Pose, seed: int) -> TracedFrame:
        """The traced layers of one picture."""
        return TracedFrame(self, RayCamera(camera, cam_from_obj), seed)

    @property
    def empty_radiance(self) -> float | None:
        """Radiance of all that lies beyond the target, None where it has to be traced."""
        return None if self.has_surroundings else self.traced.escaped

    def region(self, camera: Camera, cam_from_obj: Pose, region: Region, *, cells: int, seed: int) -> Colours:
        """Radiance of a region's pixels.

        cells: of a pixel that several edges cross, a square number. seed: of the frame, 32 bits.
        """
        frame = self.frame(camera, cam_from_obj, seed)
        wide = region.grown(BLOCKED_MARGIN, camera.width, camera.height)
        layers = self.closed.layers(camera, cam_from_obj, wide, cells)
        board = np.maximum(layers.filled - layers.disc, 0.0)
        beside = np.maximum(lens_coverage(camera)[wide.pixels] - layers.filled, 0.0)
        hidden = frame.hidden(wide, layers.filled > 0.0)
        picture = layers.paint * frame.transmission(wide)[..., None] + layers.disc[..., None] * self.disc_radiance
        picture += frame.gloss(wide, (board > 0.0) & ~hidden) * board[..., None]
        picture += frame.behind(wide, (beside > 0.0) & ~hidden) * beside[..., None]
        picture[hidden] = frame.front(wide, hidden)[hidden]
        return np.asarray(picture[_within(region, wide)] * np.float32(self.gain), np.float32)

    def surroundings(self, camera: Camera, cam_from_obj: Pose, region: Region, *, seed: int) -> Colours:
        """(camera.height, camera.width, 3) radiance of the whole picture but for a region, which holds zeros."""
        whole, coverage = Region.whole(camera.width, camera.height), lens_coverage(camera)
        chosen = coverage > 0.0
        chosen[region.pixels] = False
        frame = self.frame(camera, cam_from_obj, seed)
        radiance = frame.behind(whole, chosen) * (np.float32(self.gain) * coverage)[..., None]
        return np.asarray(radiance, np.float32)


@dataclass(frozen=True, slots=True)
class TracedFrame:
    """One picture's traced layers. Each is (height, width, 3) of a region, zero where it was not asked for."""

    scene: HybridScene
    rays: RayCamera
    seed: int

    def gloss(self, region: Region, chosen: Mask) -> Colours:
        """The board's shiny layer, as if the board filled the pixels."""
        scene = self.scene
        if scene.coat.gloss is None:
            return np.zeros((*chosen.shape, 3), np.float32)
        key = scene.rays.layer, self._key(Purpose.GLOSS)
        pixels = self._pixels(region, chosen)
        return _spread(scene.traced.gloss(scene.coat.gloss, scene.target.extent_mm, self.rays, pixels, key), chosen)

    def behind(self, region: Region, chosen: Mask) -> Colours:
        """What is seen beside the target, as if it filled the pixels."""
        pixels, key = self._pixels(region, chosen), self._key(Purpose.BEHIND)
        return _spread(self.scene.traced.behind(self.rays, pixels, self.scene.rays.background, key), chosen)

    def front(self, region: Region, chosen: Mask) -> Colours:
        """All that is seen, with the rays of what stands in front of the target."""
        pixels, key = self._pixels(region, chosen), self._key(Purpose.FRONT)
        return _spread(self.scene.traced.everything(self.rays, pixels, self.scene.rays.path, key), chosen)

    def hidden(self, region: Region, covered: Mask) -> Mask:
        """Pixels where something stands in front of the target, and a margin around them."""
        pixels, key = self._pixels(region, covered), self._key(Purpose.BLOCKED)
        share = _spread(self.scene.traced.blocked(self.rays, pixels, BLOCKED_RAYS, key), covered)
        return _grown(share > 0.0, BLOCKED_MARGIN)

    def transmission(self, region: Region) -> NDArray[np.float32]:
        """(height, width) what the board's layer lets out of its paint's light towards the camera."""
        return self.scene.coat.transmitted(self.rays.camera, self.rays.cam_from_obj, region)

    def _pixels(self, region: Region, chosen: Mask) -> NDArray[np.uint32]:
        row, column = np.nonzero(chosen)
        return ((row + region.y) * self.rays.camera.width + column + region.x).astype(np.uint32)

    def _key(self, purpose: Purpose) -> int:
        return (self.seed + 0x9E3779B9 * int(purpose)) & 0xFFFFFFFF


def _spread(values: NDArray[np.float32], chosen: Mask) -> NDArray[np.float32]:
    """Values of the chosen pixels in their places, zeros elsewhere."""
    picture = np.zeros((*chosen.shape, *values.shape[1:]), np.float32)
    picture[chosen] = values
    return picture


def _grown(mask: Mask, margin: int) -> Mask:
    """Pixels no farther than `margin` along x and along y from one of the mask."""
    height, width = mask.shape
    padded = np.pad(mask, margin)
    shifts = range(2 * margin + 1)
    return np.logical_or.reduce([padded[y : y + height, x : x + width] for y in shifts for x in shifts])


def _within(region: Region, wide: Region) -> tuple[slice, slice]:
    """Rows and columns of a region in the picture of a wider one."""
    return Region(region.x - wide.x, region.y - wide.y, region.width, region.height).pixels
