"""The plan: every frame of a recipe with its pose, camera and seeds, before anything is rendered."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from datasets.errors import UserError
from datasets.recipe.cameras import CameraSpec
from datasets.recipe.model import Recipe
from datasets.trajectories.field import FieldAngles
from datasets.trajectories.helix import Helix
from datasets.trajectories.listed import Listed
from datasets.trajectories.scatter import MAX_TRIES, Scatter
from datasets.trajectories.view import PosedFrame, hand_held
from eposit import Pose
from render.motion import PoseRate, image_points, rolling_pose
from render.sensor.presets import SensorModel
from render.targets.facing import shows_front
from render.world import WorldDraw, draw_world
from render.world.room import contains

SHARDS = 16  # of a recipe that does not say how many frames a shard has
LEAST_SHARD_FRAMES, MOST_SHARD_FRAMES = 10, 200


class Stream(IntEnum):
    """What a random number is for."""

    RENDER = 0  # rays of a path-traced reference, keyed by frame
    POINT_NOISE = 1  # noise on truth points, keyed by pose and draw
    SENSOR = 2  # noise and the light's direction, keyed by frame
    POSE = 3  # scattered poses, keyed by pose
    HAND = 4  # rates of a hand-held board, keyed by pose
    WORLD = 5  # draws of the world, keyed by pose, or by 0 where it is drawn once


@dataclass(frozen=True, slots=True)
class Frame:
    """One image to be made."""

    frame_id: int
    pose_id: int  # frames of one pose differ by camera only
    time_s: float
    camera: CameraSpec
    cam_from_obj: Pose  # under a rolling shutter a RollingPose
    rate: PoseRate  # of the pose
    sensor: SensorModel
    render_seed: int  # 32 bits
    sensor_seed: int  # 63 bits
    world: WorldDraw


def rng_for(seed: int, stream: Stream, *key: int) -> np.random.Generator:
    """The generator of one stream of one thing: the only place where seeds are made."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(int(stream), *key)))


@functools.lru_cache(maxsize=4)
def plan(recipe: Recipe) -> tuple[Frame, ...]:
    """All frames, poses outermost; a camera takes no part in poses beyond its `max_field_deg`.

    Raises:
        UserError: a target point without an image, or outside the image unless `allow_cropped`; scattered poses that
            no draw fits; a camera without any pose.
    """
    frames: list[Frame] = []
    for pose_id, view in enumerate(_views(recipe)):
        drawn = _world(recipe, pose_id)
        for camera in _planned(recipe, view.cam_from_obj):
            frame_id = len(frames)
            render_seed = int(rng_for(recipe.seed, Stream.RENDER, frame_id).integers(2**32))
            sensor_seed = int(rng_for(recipe.seed, Stream.SENSOR, frame_id).integers(2**63))
            pose = rolling_pose(view.cam_from_obj, view.rate, recipe.optics.line_time_s, camera.height)
            place = frame_id, pose_id, view.time_s, camera, pose, view.rate
            frames.append(Frame(*place, _sensor(recipe, view, drawn), render_seed, sensor_seed, drawn))
    for frame in frames:
        fault = _fault(frame.camera, frame.cam_from_obj, recipe)
        if fault:
            raise UserError(f"frame {frame.frame_id} (camera {frame.camera.name}, t = {frame.time_s:g} s): {fault}")
    idle = [camera for camera in recipe.cameras if camera.name not in {frame.camera.name for frame in frames}]
    if idle:
        raise UserError(
            f"camera {idle[0].name} sees no pose, as max_field_deg is {idle[0].max_field_deg:g}; raise it or leave the "
            "camera out"
        )
    return tuple(frames)


def frame_count(recipe: Recipe) -> int:
    """Number of frames."""
    return len(plan(recipe))


def shard_frames(recipe: Recipe) -> int:
    """Frames in one shard, but for the last: the recipe's `shard_frames`, or a sixteenth of all within 10 and 200.

    The boundaries come from the recipe alone, so that every machine cuts alike. Readers and disks like few large files,
    workers need shards to share: a sixteenth gives work to sixteen of them, and ten frames are enough for a file. Two
    hundred bound what a worker holds in memory (0.3 GB of two-megapixel pictures with noise) and what it loses when it
    is killed.
    """
    if recipe.shard_frames is not None:
        return recipe.shard_frames
    return min(MOST_SHARD_FRAMES, max(LEAST_SHARD_FRAMES, -(-frame_count(recipe) // SHARDS)))


def shard_count(recipe: Recipe) -> int:
    """Number of shards."""
    return -(-frame_count(recipe) // shard_frames(recipe))


def frames_of_shard(recipe: Recipe, index: int) -> tuple[Frame, ...]:
    """The frames of one shard, in order."""
    size = shard_frames(recipe)
    return plan(recipe)[index * size : (index + 1) * size]


def _views(recipe: Recipe) -> Iterator[PosedFrame]:
    path, target = recipe.trajectory, recipe.target
    if isinstance(path, Helix):
        for time_s in path.times():
            yield path.view(float(time_s), target)
        return
    for pose_id, (pose, defocus) in enumerate(_stands(path, recipe)):
        rng = rng_for(recipe.seed, Stream.HAND, pose_id)
        rate = hand_held(pose, target, path.speed_mm_per_s, path.turn_deg_per_s, rng)
        yield PosedFrame(float(pose_id), pose, rate, defocus)


def _stands(path: FieldAngles | Scatter | Listed, recipe: Recipe) -> Iterable[tuple[Pose, float | None]]:
    """Poses, each with its own radius of defocus, px, if it has one."""
    if isinstance(path, Listed):
        return path.stands(recipe.target)
    poses = _scattered(path, recipe) if isinstance(path, Scatter) else path.poses(recipe.target)
    return ((pose, None) for pose in poses)


def _world(recipe: Recipe, pose_id: int) -> WorldDraw:
    key = pose_id if recipe.world.draw == "pose" else 0
    return draw_world(recipe.world, rng_for(recipe.seed, Stream.WORLD, key))


def _sensor(recipe: Recipe, view: PosedFrame, drawn: WorldDraw) -> SensorModel:
    model = replace(recipe.sensor, exposure=recipe.sensor.exposure * drawn.exposure)
    return model if view.defocus_radius_px is None else replace(model, defocus_radius_px=view.defocus_radius_px)


def _scattered(path: Scatter, recipe: Recipe) -> Iterator[Pose]:
    def fits(pose: Pose) -> bool:
        cameras = _planned(recipe, pose)
        return bool(cameras) and all(_fault(camera, pose, recipe) is None for camera in cameras)

    for pose_id in range(path.count):
        rng = rng_for(recipe.seed, Stream.POSE, pose_id)
        pose = path.pose(rng, recipe.target, recipe.cameras[0].true_camera(), fits)
        if pose is None:
            raise UserError(
                f"pose {pose_id}: none of {MAX_TRIES} random poses has the whole target in every camera; increase "
                "depth_range_mm, or narrow offset_range_mm and tilt_range_deg"
            )
        yield pose


def _planned(recipe: Recipe, pose: Pose) -> list[CameraSpec]:
    """The cameras whose `max_field_deg` the board's centre does not pass."""
    x, y, z = pose.apply(recipe.target.board_centre[None])[0]
    field = np.degrees(np.arctan2(np.hypot(x, y), z)) - 1e-9  # a limit that is met is not passed
    return [camera for camera in recipe.cameras if camera.max_field_deg is None or field <= camera.max_field_deg]


def _fault(spec: CameraSpec, pose: Pose, recipe: Recipe) -> str | None:
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
