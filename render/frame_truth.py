"""Truth of one frame by rays in the scene that its picture shows."""

from __future__ import annotations

from dataclasses import dataclass

from eposit import Camera, Pose
from eposit.arrays import Mask
from render.device import DeviceScene
from render.light import Light
from render.pathtraced.picture import prepared
from render.targets.kinds import AnyTarget
from render.truth.pixels import PixelTruth, pixel_truth
from render.truth.visibility import visible_points
from render.world import World, WorldDraw
from render.world.boards import BOARD
from render.world.compose import Composition


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
