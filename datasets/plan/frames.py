"""The frames of a recipe by their numbers, each made when it is asked for."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import overload

import numpy as np

from datasets.errors import UserError
from datasets.plan.faults import cameras_of, fault_of
from datasets.plan.frame import Frame, Stream, rng_for
from datasets.plan.layout import Layout, layout_of
from datasets.plan.poses import view_of
from datasets.recipe.cameras import CameraSpec
from datasets.recipe.model import Recipe
from datasets.trajectories.scatter import Scatter
from datasets.trajectories.view import PosedFrame
from render.motion import rolling_pose
from render.sensor.presets import SensorModel
from render.world import WorldDraw, draw_world

CHECKED_FRAMES = 2000  # before anything is made, some seconds; the others when their shard is made


@dataclass(frozen=True, slots=True)
class Plan(Sequence[Frame]):
    """The frames of a recipe, poses outermost; a camera takes no part in poses beyond its `max_field_deg`.

    Raises:
        UserError: from whatever makes a frame: a target point without an image, or outside the image unless
            `allow_cropped`; a scattered pose that no draw fits.
    """

    recipe: Recipe
    layout: Layout

    def __len__(self) -> int:
        """Number of frames."""
        return self.layout.frames

    @overload
    def __getitem__(self, index: int) -> Frame: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Frame, ...]: ...

    def __getitem__(self, index: int | slice) -> Frame | tuple[Frame, ...]:
        """A frame by its number, or some of them."""
        chosen = range(len(self))[index]
        return tuple(self._made(chosen)) if isinstance(chosen, range) else next(self._made((chosen,)))

    def __iter__(self) -> Iterator[Frame]:
        """The frames one by one, none kept."""
        return self._made(range(len(self)))

    def _made(self, numbers: Sequence[int]) -> Iterator[Frame]:
        """Frames by their numbers; what frames of one pose share is made once where they follow each other."""
        last, shared = -1, None
        for frame_id in numbers:
            pose_id, place = self.layout.place(frame_id)
            if shared is None or pose_id != last:
                last, shared = pose_id, _shared(self.recipe, pose_id)
            yield _frame(self.recipe, frame_id, pose_id, shared, place)


def plan(recipe: Recipe) -> Plan:
    """All frames of a recipe, checked before anything is made of them.

    At most `CHECKED_FRAMES` are, spread evenly: of larger plans a fault between them is found when its frame is made.

    Raises:
        UserError: as `Plan`; a camera without any pose, or more poses than can be counted.
    """
    frames = frames_by_number(recipe)
    _check(recipe)
    return frames


@functools.lru_cache(maxsize=4)
def frames_by_number(recipe: Recipe) -> Plan:
    """All frames of a recipe, none checked before it is made.

    Raises:
        UserError: a camera without any pose, or more poses than can be counted.
    """
    return Plan(recipe, layout_of(recipe))


@functools.lru_cache(maxsize=4)
def _check(recipe: Recipe) -> None:
    frames = frames_by_number(recipe)
    for i in np.unique(np.linspace(0, len(frames) - 1, min(CHECKED_FRAMES, len(frames))).round().astype(int)):
        frames[int(i)]


def frame_count(recipe: Recipe) -> int:
    """Number of frames."""
    return len(frames_by_number(recipe))


@dataclass(frozen=True, slots=True)
class _Shared:
    """What the frames of one pose have in common."""

    view: PosedFrame
    world: WorldDraw
    cameras: list[CameraSpec]
    sensor: SensorModel
    fits: bool  # each camera was asked when the pose was drawn, and it does not move while a picture is read


def _shared(recipe: Recipe, pose_id: int) -> _Shared:
    view, world = view_of(recipe, pose_id), _world(recipe, pose_id)
    fits = isinstance(recipe.trajectory, Scatter) and recipe.optics.line_time_s == 0.0
    return _Shared(view, world, cameras_of(recipe, view.cam_from_obj), _sensor(recipe, view, world), fits)


def _frame(recipe: Recipe, frame_id: int, pose_id: int, shared: _Shared, place: int) -> Frame:
    """place: of the frame among those of its pose."""
    view, camera = shared.view, shared.cameras[place]
    render_seed = int(rng_for(recipe.seed, Stream.RENDER, frame_id).integers(2**32))
    sensor_seed = int(rng_for(recipe.seed, Stream.SENSOR, frame_id).integers(2**63))
    pose = rolling_pose(view.cam_from_obj, view.rate, recipe.optics.line_time_s, camera.height)
    fault = None if shared.fits else fault_of(camera, pose, recipe)
    if fault:
        raise UserError(f"frame {frame_id} (camera {camera.name}, t = {view.time_s:g} s): {fault}")
    where = frame_id, pose_id, view.time_s, camera, pose, view.rate
    return Frame(*where, shared.sensor, render_seed, sensor_seed, shared.world)


def _world(recipe: Recipe, pose_id: int) -> WorldDraw:
    key = pose_id if recipe.world.draw == "pose" else 0
    return draw_world(recipe.world, rng_for(recipe.seed, Stream.WORLD, key))


def _sensor(recipe: Recipe, view: PosedFrame, drawn: WorldDraw) -> SensorModel:
    model = replace(recipe.sensor, exposure=recipe.sensor.exposure * drawn.exposure)
    return model if view.defocus_radius_px is None else replace(model, defocus_radius_px=view.defocus_radius_px)
