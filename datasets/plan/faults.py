"""What makes a pose in front of a camera unusable, and which cameras take part in a pose."""

from __future__ import annotations

import numpy as np

from datasets.recipe.cameras import CameraSpec
from datasets.recipe.model import Recipe
from eposit import Pose
from render.motion import image_points
from render.targets.facing import shows_front
from render.world.room import contains


def cameras_of(recipe: Recipe, pose: Pose) -> list[CameraSpec]:
    """The cameras whose `max_field_deg` the board's centre does not pass."""
    x, y, z = pose.apply(recipe.target.board_centre[None])[0]
    field = np.degrees(np.arctan2(np.hypot(x, y), z)) - 1e-9  # a limit that is met is not passed
    return [camera for camera in recipe.cameras if camera.max_field_deg is None or field <= camera.max_field_deg]


def fault_of(spec: CameraSpec, pose: Pose, recipe: Recipe) -> str | None:
    """What is wrong with a pose in front of a camera, with the remedy; None if nothing."""
    camera = spec.true_camera()
    if not shows_front(recipe.target, pose.inverse().t):
        return "the camera is behind the board or a bent part of it; turn the target's front towards it"
    if recipe.world.surround == "room" and not contains(recipe.world, recipe.target, pose.inverse().t):
        return "the camera is outside the room; increase world.room_mm, or world.floor_mm where it is below the floor"
    projected = image_points(camera, pose, recipe.target.points)
    count, unseen = len(projected), int(np.sum(np.isnan(projected).any(axis=1)))
    if unseen == count or (unseen and not recipe.allow_cropped):
        remedy = "" if unseen == count else ", or set allow_cropped = true"
        return (
            f"{unseen} of {count} target points are behind the camera or beyond the lens; "
            f"move the target in front of it{remedy}"
        )
    outside = int(np.sum(~camera.contains(projected)))
    if outside == count or (outside and not recipe.allow_cropped):
        remedy = "move the target" if outside == count else "move the target, or set allow_cropped = true"
        return f"{outside} of {count} target points lie outside the image; {remedy}"
    return None
