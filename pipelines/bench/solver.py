"""Throughput of `eposit.solve`, one call at a time and in a batch, against PoseLib in a loop."""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import Any

import numpy as np

import eposit
from datasets.plan import plan
from datasets.recipe import Recipe
from eposit.arrays import Array
from pipelines.bench.rows import Row, compared
from pipelines.bench.timing import Times, in_turn

PART = "solver"
NOISE_PX = 0.1
SINGLE = 20  # poses in a measurement of single calls
FOUR_BATCH, ALL_BATCH = 4096, 64  # poses in a batch of four points each, and of all points each


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """Rows for four points and for all, single calls and a batch; perspective, the only lens that PoseLib shares."""
    del poses  # the numbers of poses are its own
    camera = next((spec for spec in recipe.cameras if spec.lens == "perspective"), recipe.cameras[0]).true_camera()
    camera = camera.replace(lens="perspective", coefficients=())
    pose = plan(recipe)[0].cam_from_obj
    for points, count in (
        (recipe.target.points[recipe.four_indices()], FOUR_BATCH),
        (recipe.target.points, ALL_BATCH),
    ):
        true = camera.project(pose.apply(points))
        pixels = true + NOISE_PX * np.random.default_rng(0).standard_normal((count, *true.shape))
        size = f"{len(points)} points"
        single = [functools.partial(eposit.solve, points, image, camera) for image in pixels[:SINGLE]]
        batch = functools.partial(eposit.solve, points, pixels, camera)
        robust, minimal = _robust(points, camera), _minimal(points, camera)
        few = pixels[:SINGLE]
        one, many, that, three = in_turn(
            lambda calls=single: [call() for call in calls],
            batch,
            lambda call=robust, images=few: [call(image) for image in images],
            lambda call=minimal, images=few: [call(image) for image in images],
        )
        own, many = _each(one, SINGLE), _each(many, count)
        for name, times in (("estimate_absolute_pose", that), ("p3p, up to four candidates", three)):
            other = f"PoseLib {name}, in a loop"
            yield compared(PART, f"solve, {size}, single call, a pose", own, other, _each(times, SINGLE))
            yield compared(PART, f"solve, {size}, batch of {count}, a pose", many, other, _each(times, SINGLE))


def _each(times: Times, count: int) -> Times:
    return Times(times.wall / count, times.cpu / count)


def _robust(points: Array, camera: eposit.Camera) -> Any:
    """PoseLib's RANSAC and refinement for one image."""
    import poselib

    parameters = [camera.fx, camera.fy, camera.cx, camera.cy]
    described = {"model": "PINHOLE", "width": camera.width, "height": camera.height, "params": parameters}
    return lambda image: poselib.estimate_absolute_pose(image, points, described)


def _minimal(points: Array, camera: eposit.Camera) -> Any:
    """PoseLib's solver for three points, rays included."""
    import poselib

    first = points[:3] if np.linalg.matrix_rank(points[1:3] - points[0]) == 2 else points[[0, 1, -1]]
    return lambda image: poselib.p3p(camera.bearing(image[:3]), first)
