"""A frame of ours, detection included, against a plain Mitsuba script that renders the full picture."""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.plan import Frame
from datasets.recipe.model import Recipe
from datasets.store.images import encode_png
from datasets.store.linear_images import write_linear
from pipelines.bench.cases import chosen_frames, image_of, linear_of
from pipelines.bench.table import Row, compared
from pipelines.detection import detect_points
from pipelines.timing import Times, in_turn, total
from render import backend
from render.pathtraced.fisheye import sensor_dict
from render.pathtraced.scene import reference_scene
from render.targets.image_region import Region

PART = "frame"
PLAIN_SAMPLES = 64
Film = NDArray[np.float32]
WARM_UP = Region.whole(16, 16)  # compiles the plain kernel, which serves any region
_NAME = f"full picture, Mitsuba direct, {PLAIN_SAMPLES} rays"


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """One row for each camera, and one for all of them together."""
    sums: list[list[Times]] = []
    for camera, frames in chosen_frames(recipe, poses).items():
        own, plain = _sums(recipe, frames)
        sums.append([own, plain])
        yield compared(PART, f"{camera}: frame and detection", own, _NAME, plain, len(frames))
    own, plain = (total(list(column)) for column in zip(*sums, strict=True))
    yield compared(PART, "one frame of each camera", own, _NAME, plain, poses)


def _sums(recipe: Recipe, frames: list[Frame]) -> list[Times]:
    """Ours and the plain one, summed over frames: the plain one takes seconds, so that once is enough."""
    frame_of_ours(recipe, frames[0])
    plain(recipe, frames[0], region=WARM_UP)
    times = [
        in_turn(
            functools.partial(frame_of_ours, recipe, frame),
            functools.partial(plain, recipe, frame),
            repeats=1,
            warm_up=False,
        )
        for frame in frames
    ]
    return [total(list(column)) for column in zip(*times, strict=True)]


def frame_of_ours(recipe: Recipe, frame: Frame) -> None:
    """Everything that a frame of a dataset costs, one after the other."""
    camera = frame.camera.true_camera()
    with tempfile.TemporaryDirectory() as folder:
        linear = linear_of(recipe, frame)
        write_linear(linear, camera, Path(folder) / "linear.exr")
        image = image_of(recipe, frame, linear)
        encode_png(image)
        detect_points(image, recipe.target)


def plain(recipe: Recipe, frame: Frame, samples: int = PLAIN_SAMPLES, region: Region | None = None) -> Film:
    """What a first script does: the whole picture, one lamp sample for each ray, independent samples.

    region: a part of the picture instead. Returns (height, width, 2): radiance and share of hits.
    """
    mi = backend.load()
    camera = frame.camera.true_camera()
    region = Region.whole(camera.width, camera.height) if region is None else region
    sensor = sensor_dict(camera, frame.cam_from_obj, region, samples)
    sensor["sampler"] = {"type": "independent", "sample_count": samples}
    integrator = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 0, "hide_emitters": True})
    scene = reference_scene(recipe.target, recipe.light)
    return np.array(mi.render(scene, sensor=mi.load_dict(sensor), integrator=integrator, spp=samples, seed=0))
