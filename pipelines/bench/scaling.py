"""How cost grows: the slope of log CPU time over log size, from three sizes measured in turn."""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np

from datasets.plan import Frame, plan
from datasets.recipe.model import Recipe
from datasets.store.images import encode_png
from datasets.store.linear_images import write_linear
from pipelines.bench.cases import chosen_poses, linear_of, scaled
from pipelines.bench.end_to_end import by_pose, run_stages
from pipelines.bench.table import Figure, Row, short
from pipelines.detection import detect_points
from pipelines.timing import in_turn
from render.sensor.develop import develop

PART = "growth"
POSES, SCALES, SAMPLES = (1, 2, 4), (0.5, 1.0, 2.0), (64, 256, 1024)  # poses, resolution along a side, cells of a pixel


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """Exponents of frames, pixels and samples."""
    del poses  # three sizes are three sizes
    yield _stages_by_frames(recipe)
    sizes = [scaled(recipe, factor) for factor in SCALES]
    for camera in (recipe.cameras[0].name, recipe.cameras[-1].name):
        yield _frame_by_pixels(sizes, camera)
        yield _detection_by_pixels(sizes, camera)
        yield _render_by_samples(recipe, camera)


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """Slope of log seconds over log size."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def _stages_by_frames(recipe: Recipe) -> Row:
    staged = by_pose(recipe)
    runs = [functools.partial(run_stages, staged, chosen_poses(recipe, count)) for count in POSES]
    return _row("all stages at {} frames", [len(recipe.cameras) * count for count in POSES], runs)


def _frame_by_pixels(sizes: Sequence[Recipe], camera: str) -> Row:
    frames = [functools.partial(_frame, size, camera) for size in sizes]
    return _row(camera + ": frame without detection at {} pixels", _pixels(sizes), frames)


def _detection_by_pixels(sizes: Sequence[Recipe], camera: str) -> Row:
    detections = [functools.partial(detect_points, _image(size, camera), size.target) for size in sizes]
    return _row(camera + ": detection at {} pixels", _pixels(sizes), detections)


def _render_by_samples(recipe: Recipe, camera: str) -> Row:
    frame = _first_frame(recipe, camera)
    renders = [functools.partial(linear_of, recipe, frame, samples) for samples in SAMPLES]
    return _row(camera + ": render at {} samples", SAMPLES, renders)


def _pixels(sizes: Sequence[Recipe]) -> list[int]:
    return [size.cameras[0].width * size.cameras[0].height for size in sizes]


def _row(what: str, sizes: Sequence[float], calls: Sequence[Callable[[], object]]) -> Row:
    """what: says what was measured, with a place for the sizes."""
    times = in_turn(*calls)
    slope = exponent(sizes, [time.cpu for time in times])
    spent = " / ".join(short(1e3 * time.wall) for time in times)
    return Figure(
        PART, what.format(" / ".join(f"{size:g}" for size in sizes)), f"{spent} ms", "", f"exponent {slope:.2f}"
    )


def _frame(recipe: Recipe, camera: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        frame = _first_frame(recipe, camera)
        linear = linear_of(recipe, frame)
        write_linear(linear, frame.camera.true_camera(), Path(folder) / "linear.exr")
        encode_png(develop(linear.full(frame.camera.true_camera()), frame.sensor))


def _image(recipe: Recipe, camera: str) -> np.ndarray:
    frame = _first_frame(recipe, camera)
    return develop(linear_of(recipe, frame).full(frame.camera.true_camera()), frame.sensor)


def _first_frame(recipe: Recipe, camera: str) -> Frame:
    return next(frame for frame in plan(recipe) if frame.camera.name == camera)
