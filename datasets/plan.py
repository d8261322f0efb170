"""The plan: every frame of a recipe with its pose, camera and seeds, before anything is rendered."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from datasets.errors import UserError
from datasets.recipe import CameraSpec, Recipe
from eposit import Pose


class Stream(IntEnum):
    """What a random number is for."""

    RENDER = 0  # rays of a path-traced reference, keyed by frame
    POINT_NOISE = 1  # noise on truth points, keyed by pose and draw


@dataclass(frozen=True, slots=True)
class Frame:
    """One image to be made."""

    frame_id: int
    pose_id: int  # frames of one pose differ by camera only
    time_s: float
    camera: CameraSpec
    cam_from_obj: Pose
    render_seed: int  # 32 bits


def rng_for(seed: int, stream: Stream, *key: int) -> np.random.Generator:
    """The generator of one stream of one thing: the only place where seeds are made."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(stream), *key)))


@functools.lru_cache(maxsize=4)
def plan(recipe: Recipe) -> tuple[Frame, ...]:
    """All frames, poses outermost: frame_id = pose_id * cameras + camera.

    Raises:
        UserError: a target point without an image, or outside the image unless `allow_cropped`.
    """
    frames: list[Frame] = []
    for pose_id, time_s in enumerate(recipe.trajectory.times()):
        pose = recipe.trajectory.cam_from_obj(float(time_s), recipe.target)
        for camera in recipe.cameras:
            frame_id = len(frames)
            seed = int(rng_for(recipe.seed, Stream.RENDER, frame_id).integers(2**32))
            frames.append(Frame(frame_id, pose_id, float(time_s), camera, pose, seed))
    for frame in frames:
        _check(frame, recipe)
    return tuple(frames)


def frame_count(recipe: Recipe) -> int:
    """Number of frames, without making the plan."""
    return len(recipe.trajectory.times()) * len(recipe.cameras)


def shard_count(recipe: Recipe) -> int:
    """Number of shards; the boundaries come from the recipe alone."""
    return -(-frame_count(recipe) // recipe.shard_frames)


def _check(frame: Frame, recipe: Recipe) -> None:
    camera, points = frame.camera.true_camera(), frame.cam_from_obj.apply(recipe.target.points)
    where = f"frame {frame.frame_id} (camera {frame.camera.name}, t = {frame.time_s:g} s)"
    position = frame.cam_from_obj.inverse().t
    if position[2] >= -recipe.target.circle_height_mm:
        raise UserError(f"{where}: the camera is behind the board; turn the target's front towards it")
    projected = camera.project(points)
    unseen = int(np.sum(np.isnan(projected).any(axis=1)))
    if unseen:
        raise UserError(
            f"{where}: {unseen} of {len(points)} target points are behind the camera or beyond the lens; "
            "move the target in front of it"
        )
    outside = int(np.sum(~camera.contains(projected)))
    if outside == len(points) or (outside and not recipe.allow_cropped):
        remedy = "move the target" if outside == len(points) else "move the target, or set allow_cropped = true"
        raise UserError(f"{where}: {outside} of {len(points)} target points lie outside the image; {remedy}")
