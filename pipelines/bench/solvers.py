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
from eposit import Camera, Pose, gpnpf, opnp, pnpfr, released
from eposit.arrays import Array
from eposit.pose import rotation_from_euler
from pipelines.adapters.registry import find_solver
from pipelines.bench.table import Row, compared
from pipelines.bench.timing import Times, in_turn

PART = "solver, a pose of four points"
POINTS = np.array([(0.0, 0.0, 0.0), (200.0, 0.0, 0.0), (0.0, 200.0, 0.0), (0.0, 0.0, -50.0)])  # mm, the paper's object
CAMERA = Camera(
    lens="perspective", fx=1378.65, fy=1381.37, cx=807.41661, cy=602.4737, width=1600, height=1200
)  # fmt: skip
NOISE_PX = 0.4
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
    pixels = draws(BATCH)
    loops = {f"PoseLib {name}, in a loop": call for name, call in _poselib(pixels[:LOOPED]).items()}
    with threadpool_limits(1):
        for solver in solvers():
            single = functools.partial(_each_alone, solver, pixels[:SINGLE])
            yield from _rows(f"{solver.name}, single call", single, SINGLE, loops)
            if solver.batch:
                batch, name = functools.partial(solver.call, POINTS, pixels[: solver.batch], CAMERA), solver.name
                yield from _rows(f"{name}, batch of {solver.batch}", batch, solver.batch, loops)


def draws(count: int) -> Array:
    """(count, 4, 2) noisy image points, px: the frames of the paper's helix, one degree apart, again and again."""
    t = np.arange(361.0)
    phase = np.deg2rad(45.0 + t)
    position = np.stack((100.0 * np.sqrt(2.0) * np.cos(phase), 100.0 * np.sqrt(2.0) * np.sin(phase), 2000.0 + 0.25 * t))
    angles = np.repeat(np.deg2rad(20.0 + 0.1 * t)[:, None], 3, axis=1)
    exact = CAMERA.project(Pose(rotation_from_euler(angles), position.T).apply(POINTS))
    return exact[np.arange(count) % len(t)] + NOISE_PX * np.random.default_rng(0).standard_normal((count, 4, 2))


def _each_alone(solver: Solver, images: Array) -> None:
    for image in images:
        solver.call(POINTS, image, CAMERA)


def _rows(name: str, call: Callable[[], object], count: int, loops: dict[str, Callable[[], object]]) -> Iterator[Row]:
    own, *others = in_turn(call, *loops.values(), repeats=REPEATS)
    for other, times in zip(loops, others, strict=True):
        yield compared(PART, name, _per_pose(own, count), other, _per_pose(times, LOOPED))


def _per_pose(times: Times, count: int) -> Times:
    return Times(times.wall / count, times.cpu / count)


def _poselib(images: Array) -> dict[str, Callable[[], object]]:
    """PoseLib's solver for three points, up to four candidates each, with rays made beforehand and in the loop."""
    import poselib

    first = POINTS[:3].copy()
    rays = list(CAMERA.bearing(images[:, :3]))
    beforehand, inside = "p3p on given rays", "p3p and its rays"
    return {
        beforehand: lambda: [poselib.p3p(ray, first) for ray in rays],
        inside: lambda: [poselib.p3p(CAMERA.bearing(image[:3]), first) for image in images],
    }
