"""What the paper leaves open and we infer, each varied alone: how far its numbers depend on it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import eposit
from datasets.trajectories.helix import Helix
from eposit import Pose, Solution, released
from eposit.arrays import Array
from pipelines.pages.sections import Table
from pipelines.paper import simulation as sim
from pipelines.paper.claims import PaperSection
from pipelines.paper.problems import OBJECT, poses_on
from pipelines.statistics import bootstrap, mean

LENSES = ("perspective", "equidistance", "orthogonal")
HEAD = (
    "inference",
    "varied to",
    "camera",
    "z, equations, mm",
    "z, released, mm",
    "x, y, equations, mm",
    "r, equations, deg",
)


def sensitivity(seeds: int) -> PaperSection:
    """Mean errors under each change."""
    rows: list[tuple[str, ...]] = []
    for inference, change, path, shared, methods in _variants():
        for lens in LENSES:
            problem = sim.draws(lens, seeds, path=path, shared=shared)
            errors = [sim.outcome(problem, call).error for call in methods]
            rows.append((inference, change, lens, *_cells(errors)))
    intro = (
        "The paper does not state the range of t, its step, the start angles, whether the lenses share their noise, or "
        "where the principal point enters. Our reading, which reproduces its numbers, and what changes without it."
    )
    note = "Mean errors with 95 % intervals over the draws; of x and y, and of the rotation, the largest component."
    return PaperSection("Our inferences", intro, (Table("Sensitivity", HEAD, tuple(rows), note),))


def _variants() -> list[tuple[str, str, Pose | None, bool, tuple[sim.Estimate, sim.Estimate]]]:
    principal = (sim.equations_from_principal_point, sim.as_released_from_principal_point)
    return [
        ("none", "our reading", None, True, principal),
        ("range of t", "0 to 90 s", poses_on(Helix(point="origin", stop=90.0)), True, principal),
        ("step of t", "5 s", poses_on(Helix(point="origin", step=5.0)), True, principal),
        ("start angles", "0 degrees", poses_on(Helix(point="origin", angle_deg=(0.0, 0.0, 0.0))), True, principal),
        ("shared noise", "each lens its own", None, False, principal),
        ("theta", "from the image centre", None, True, (sim.equations, sim.as_released)),
        ("camera", "image centre everywhere", None, True, (_with("eposit", "nominal"), _with("released", "nominal"))),
        ("camera", "true focal length, too", None, True, (_with("eposit", "camera"), _with("released", "camera"))),
    ]


def _with(solver: str, camera: str) -> Callable[[sim.Draws], Solution]:
    def estimate(problem: sim.Draws) -> Solution:
        if solver == "released":
            return released.solve(OBJECT, problem.pixels, getattr(problem, camera))
        return eposit.solve(OBJECT, problem.pixels, getattr(problem, camera), solver)

    return estimate


def _cells(errors: list[Array]) -> tuple[str, ...]:
    first = np.nanmean(errors[0], axis=(0, 1))
    z = (bootstrap(error[..., 5], mean).text(3) for error in errors)
    largest = [part[np.argmax(np.abs(part))] for part in (first[3:5], first[:3])]
    return (*z, *(f"{value:.2g}" for value in largest))
