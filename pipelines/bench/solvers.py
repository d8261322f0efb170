"""Poses per second of every solver, one call at a time and in a batch, against PoseLib's p3p in a loop.

All run on the draws of the paper's simulation: four points, 0.4 px of noise, the pinhole camera; on one thread.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

import eposit
from datasets.recipe.model import Recipe
from eposit import Camera, gpnpf, opnp, pnpfr, released
from eposit.arrays import Array
from pipelines.adapters.registry import find_solver
from pipelines.bench.table import Row, compared
from pipelines.paper.problems import OBJECT, camera_with, helix, noisy, taken
from pipelines.timing import in_turn

PART = "solver, a pose of four points"
BATCH = 100_000  # poses in a batch; what takes longer than a second of it gets fewer
SINGLE = 20  # poses in a measurement of single calls
LOOPED = 2000  # calls of PoseLib in a measurement
REPEATS = 7  # these calls are short, and the machine's clock changes under them

Call = Callable[[Array, Array, Camera], Any]


@dataclass(frozen=True, slots=True)
class Solver:
    """A row of the table: points (n, 3), image points (n, 2) or a batch of them, camera."""

    name: str
    call: Call
    batch: int = BATCH  # poses in its batch; 0 for a solver that takes one image at a time


def solvers() -> list[Solver]:
    """The solvers measured: a new one is a line here."""
    methods = [Solver(f"solve {name}", functools.partial(eposit.solve, method=name)) for name in eposit.METHODS]
    others = ("opencv-sqpnp", "opencv-epnp", "opencv-p3p", "poselib-p3p", "poselib-p4pf")  # one image after the other
    return [
        *methods,
        Solver("released", released.solve),
        Solver("gpnpf", gpnpf.solve, 2000),
        Solver("pnpfr", pnpfr.solve, 2000),
        Solver("opnp", opnp.solve, 200),
        *(Solver(name, find_solver(name), 0) for name in others),
    ]


def measure(recipe: Recipe, poses: int) -> Iterator[Row]:
    """Rows for every solver, single calls and a batch. The draws are the paper's and not the recipe's."""
    del recipe, poses
    camera, pixels = camera_with("perspective"), draws(BATCH)
    loops = {f"PoseLib {name}, in a loop": call for name, call in _poselib(pixels[:LOOPED], camera).items()}
    with threadpool_limits(1):
        for solver in solvers():
            single = functools.partial(_each_alone, solver, pixels[:SINGLE], camera)
            yield from _rows(f"{solver.name}, single call", single, SINGLE, loops)
            if solver.batch:
                batch, name = functools.partial(solver.call, OBJECT, pixels[: solver.batch], camera), solver.name
                yield from _rows(f"{name}, batch of {solver.batch}", batch, solver.batch, loops)


def draws(count: int) -> Array:
    """(count, 4, 2) noisy image points, px: the frames of the paper's helix, one degree apart, again and again."""
    path = helix()
    return noisy(camera_with("perspective"), OBJECT, taken(path, np.arange(count) % len(path.t)), seed=0)


def _each_alone(solver: Solver, images: Array, camera: Camera) -> None:
    for image in images:
        solver.call(OBJECT, image, camera)


def _rows(name: str, call: Callable[[], object], count: int, loops: dict[str, Callable[[], object]]) -> Iterator[Row]:
    own, *others = in_turn(call, *loops.values(), repeats=REPEATS)
    for other, times in zip(loops, others, strict=True):
        yield compared(PART, name, own / count, other, times / LOOPED)


def _poselib(images: Array, camera: Camera) -> dict[str, Callable[[], object]]:
    """PoseLib's solver for three points, up to four candidates each, with rays made beforehand and in the loop."""
    import poselib

    first = OBJECT[:3].copy()
    rays = list(camera.bearing(images[:, :3]))
    beforehand, inside = "p3p on given rays", "p3p and its rays"
    return {
        beforehand: lambda: [poselib.p3p(ray, first) for ray in rays],
        inside: lambda: [poselib.p3p(camera.bearing(image[:3]), first) for image in images],
    }
