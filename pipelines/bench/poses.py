"""One pose at a time, and many: our solver beside OpenCV's and PoseLib's on four kinds of object; import, first use."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator

import cv2
import numpy as np
from threadpoolctl import threadpool_limits

import eposit
from datasets.recipe.model import Recipe
from pipelines.bench import first_use
from pipelines.bench.other_pose_solvers import samplers, solvers
from pipelines.bench.pose_problems import Problems, half_wrong, problems
from pipelines.bench.table import Figure, Row, compared
from pipelines.paper.problems import SIGMA_PX
from pipelines.timing import in_turn

PART = "poses"
IMAGES = 50  # single calls in a measurement
BATCH = 10_000  # images of a batch
ROBUST_MS = 5.0  # that a call may take with half of a board's points wrong
REPEATS = 21  # a measurement takes a millisecond; the machine's clock changes under it, and others use it

Call = Callable[[], object]


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """Rows for single calls and batches, for wrong points, and for the first call. The problems are the part's own."""
    del recipe, poses
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        with threadpool_limits(1):
            for given in problems(IMAGES):
                yield from _one_kind(given)
            yield from _wrong_points(half_wrong(problems(IMAGES)[-1]))
    finally:
        cv2.setNumThreads(threads)
    yield from first_use.rows(PART)


def _one_kind(given: Problems) -> Iterator[Row]:
    others = {f"{name}, single call": _each(call) for name, call in solvers(given).items()}
    many = np.tile(given.pixels, (BATCH // IMAGES, 1, 1))
    for method in ("best", "eposit") if given.has_depth else ("best",):
        solve = functools.partial(eposit.solve, given.points, camera=given.camera, method=method)
        yield from _rows(f"{method}, {given.name}, single call", _each_image(given, solve), IMAGES, others)
        batch = functools.partial(solve, many)
        yield from _rows(f"{method}, {given.name}, batch of {BATCH}", batch, BATCH, others)


def _wrong_points(given: Problems) -> Iterator[Row]:
    solve = functools.partial(eposit.solve, given.points, camera=given.camera, sigma_px=SIGMA_PX, robust=True)
    others = {f"{name}, single call": _each(call) for name, call in samplers(given).items()}
    name = f"robust, {given.name}, single call"
    ours, *theirs = in_turn(_each_image(given, solve), *others.values(), repeats=REPEATS)
    for other, times in zip(others, theirs, strict=True):
        yield compared(PART, name, ours / IMAGES, other, times / IMAGES)
    yield Figure(PART, f"{name}, processor time", f"{1e3 * ours.cpu / IMAGES:.2g} ms", "bound", f"{ROBUST_MS:g} ms")


def _each_image(given: Problems, solve: Callable[..., object]) -> Call:
    images = list(given.pixels)
    return _each(lambda i: solve(images[i]))


def _each(call: Callable[[int], object]) -> Call:
    def all_of_them() -> None:
        for i in range(IMAGES):
            call(i)

    return all_of_them


def _rows(name: str, own: Call, count: int, others: dict[str, Call]) -> Iterator[Row]:
    ours, *theirs = in_turn(own, *others.values(), repeats=REPEATS)
    for other, times in zip(others, theirs, strict=True):
        yield compared(PART, name, ours / count, other, times / IMAGES)
