"""Frames per second of a recipe, detection included, against a plain Mitsuba script that renders full frames."""

from __future__ import annotations

import statistics
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from datasets.plan import Frame, plan
from datasets.recipe import Recipe
from pipelines.detection import detect_points
from render import backend
from render.develop import develop, encode_png
from render.master import render_master, write_master
from render.scene import reference_scene
from render.sensor import sensor_dict


@dataclass(frozen=True, slots=True)
class Row:
    """One camera's medians over its frames, s."""

    camera: str
    ours_s: float  # render the region, write the master, develop, encode, detect
    detect_s: float  # of which detection
    plain_s: float  # render the full frame

    @property
    def ratio(self) -> float:
        """How many of our frames fit into one plain frame."""
        return self.plain_s / self.ours_s


def measure(recipe: Recipe, poses: int) -> list[Row]:
    """Alternate our frame and the plain one over evenly chosen poses; the first pose of each camera warms up."""
    frames = plan(recipe)
    chosen = sorted({int(i) for i in np.linspace(0, frames[-1].pose_id, poses).round()})
    rows: list[Row] = []
    for camera in recipe.cameras:
        own = [frame for frame in frames if frame.camera.name == camera.name]
        _ours(recipe, own[0])
        _plain(recipe, own[0])
        times = [
            (*_ours(recipe, frame), _timed(lambda frame=frame: _plain(recipe, frame)))
            for frame in own
            if frame.pose_id in chosen
        ]
        ours, detect, plain = (statistics.median(column) for column in zip(*times, strict=True))
        rows.append(Row(camera.name, ours, detect, plain))
    return rows


def overall(rows: list[Row]) -> float:
    """The ratio over all cameras together: one frame of each."""
    return sum(row.plain_s for row in rows) / sum(row.ours_s for row in rows)


def _ours(recipe: Recipe, frame: Frame) -> tuple[float, float]:
    """Seconds of everything that a frame of a dataset costs, and of its detection alone."""
    camera = frame.camera.true_camera()
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        master = render_master(
            recipe.target,
            recipe.light,
            camera,
            frame.cam_from_obj,
            samples=recipe.sample_count(),
            seed=frame.render_seed,
        )
        write_master(master, camera, Path(folder) / "master.exr")
        image = develop(master.full(camera), recipe.sensor)
        encode_png(image)
        middle = time.perf_counter()
        detect_points(image, recipe.target)
        end = time.perf_counter()
    return end - begin, end - middle


def _plain(recipe: Recipe, frame: Frame) -> None:
    """What a first script does: the whole picture, one lamp sample for each ray, independent samples."""
    mi = backend.load()
    camera = frame.camera.true_camera()
    sensor = sensor_dict(camera, frame.cam_from_obj, (0, 0, camera.width, camera.height), recipe.sample_count())
    sensor["sampler"] = {"type": "independent", "sample_count": recipe.sample_count()}
    integrator = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 0, "hide_emitters": True})
    scene = reference_scene(recipe.target, recipe.light)
    np.array(mi.render(scene, sensor=mi.load_dict(sensor), integrator=integrator, spp=recipe.sample_count(), seed=0))


def _timed(call: Callable[[], None]) -> float:
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin
