"""Frames and recipes that are measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.plan import Frame, plan
from datasets.recipe.cameras import CameraSpec
from datasets.recipe.model import Recipe
from eposit import Camera
from pipelines.detection import detect_points
from render.analytic.image_circle import lens_coverage
from render.frame import LinearImage, render_frame
from render.region import Image
from render.sensor.develop import FrameContext, develop
from render.targets.image_region import Region


def chosen_poses(recipe: Recipe, poses: int) -> list[int]:
    """Numbers of evenly spread poses."""
    return sorted({int(i) for i in np.linspace(0, plan(recipe)[-1].pose_id, poses).round()})


def chosen_frames(recipe: Recipe, poses: int) -> dict[str, list[Frame]]:
    """Frames of each camera, by its name."""
    chosen = set(chosen_poses(recipe, poses))
    found: dict[str, list[Frame]] = {camera.name: [] for camera in recipe.cameras}
    for frame in plan(recipe):
        if frame.pose_id in chosen:
            found[frame.camera.name].append(frame)
    return found


def linear_of(recipe: Recipe, frame: Frame, samples: int | None = None) -> LinearImage:
    """A frame's linear light, at the recipe's samples if none are given."""
    return render_frame(
        recipe.chessboard(),
        recipe.light,
        frame.camera.true_camera(),
        frame.cam_from_obj,
        samples=recipe.sample_count() if samples is None else samples,
    )


def image_of(recipe: Recipe, frame: Frame, linear: LinearImage | None = None) -> NDArray[np.uint8]:
    """The developed picture of a frame, of its own light if none is given."""
    camera = frame.camera.true_camera()
    light = linear_of(recipe, frame) if linear is None else linear
    context = FrameContext(recipe.target, camera, frame.cam_from_obj, frame.rate, light.region, frame.sensor_seed)
    return develop(light.full(camera), frame.sensor, context)


def over_background(recipe: Recipe, camera: Camera, film: Image, region: Region) -> LinearImage:
    """The light of a region from another renderer's film, (height, width, 2): radiance and share of hits."""
    behind = np.maximum(lens_coverage(camera)[region.pixels] - film[..., 1], 0.0)
    return LinearImage(
        (film[..., 0] + recipe.light.background * behind).astype(np.float32), region, recipe.light.background
    )


def corner_errors(recipe: Recipe, frame: Frame, linear: LinearImage) -> NDArray[np.float64]:
    """(n, 2) errors, px, of the corners that our detection finds in the picture; NaN where it finds none."""
    target = recipe.chessboard()
    found = detect_points(image_of(recipe, frame, linear), target).points_px
    truth = frame.camera.true_camera().project(frame.cam_from_obj.apply(target.points))
    return (found - truth)[: target.circle_index]


def rms(errors: list[NDArray[np.float64]]) -> float:
    """Root mean square of all that are there."""
    return float(np.sqrt(np.nanmean(np.concatenate(errors) ** 2)))


def scaled(recipe: Recipe, factor: float) -> Recipe:
    """The recipe with `factor` times the pixels along each side and the same field of view."""
    return recipe.model_copy(update={"cameras": tuple(_scaled_camera(camera, factor) for camera in recipe.cameras)})


def _scaled_camera(camera: CameraSpec, factor: float) -> CameraSpec:
    return replace(
        camera,
        fx=factor * camera.fx,
        fy=factor * camera.fy,
        cx=factor * (camera.cx + 0.5) - 0.5,
        cy=factor * (camera.cy + 0.5) - 0.5,
        width=round(factor * camera.width),
        height=round(factor * camera.height),
        nominal_f=None if camera.nominal_f is None else factor * camera.nominal_f,
    )
