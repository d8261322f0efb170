"""What a pose costs by EPOSIT, by POSIT and by the solvers that the paper compares."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import eposit
from eposit import gpnpf, opnp, pnpfr
from pipelines.adapters.registry import find_solver
from pipelines.pages.sections import Table
from pipelines.paper import simulation as sim
from pipelines.paper.claims import Claim, Statement, holds_if
from pipelines.paper.problems import OBJECT
from pipelines.paper.simulation.comparison import SIMILAR
from pipelines.timing import in_turn

PART = "derivation"
COMPARED = ("SQPNP", "GPnPf", "PnPfr", "OPnP")


@dataclass(frozen=True, slots=True)
class Cost:
    """By solver."""

    time_us: dict[str, float]  # processor time of a pose in a batch
    steps: dict[str, float]  # median iterations

    def over(self, name: str) -> float:
        """Its time over EPOSIT's."""
        return self.time_us[name] / self.time_us["EPOSIT"]


def measure(seeds: int) -> tuple[tuple[Table, ...], tuple[Claim, ...]]:
    """The table and the claim."""
    del seeds
    found = Cost(_times_us(), _steps())
    rows = tuple(
        (name, f"{found.steps[name]:.0f}" if name in found.steps else "", f"{time:.3g}", f"{found.over(name):.3g}")
        for name, time in found.time_us.items()
    )
    table = Table(
        "Cost of a pose in a batch", ("solver", "median iterations", "processor time, us", "over EPOSIT's"), rows,
        f"The helix through the orthogonal fish-eye; {', '.join(COMPARED)} on the pinhole. Calls in turn.",
    )  # fmt: skip
    return (table,), (STATEMENT.judged(found),)


def _times_us() -> dict[str, float]:
    fisheye, pinhole = (sim.draws(lens, 1) for lens in ("orthogonal", "perspective"))
    calls: dict[str, Callable[[], object]] = {
        "EPOSIT": functools.partial(eposit.solve, OBJECT, fisheye.pixels, fisheye.camera, "eposit"),
        "POSIT": functools.partial(eposit.solve, OBJECT, fisheye.pixels, fisheye.camera, "posit"),
        "EPOSIT, released": functools.partial(sim.as_released_exact, fisheye),
        "SQPNP": functools.partial(find_solver("opencv-sqpnp"), OBJECT, pinhole.pixels, pinhole.camera),
        "GPnPf": functools.partial(gpnpf.solve, OBJECT, pinhole.pixels, pinhole.camera),
        "PnPfr": functools.partial(pnpfr.solve, OBJECT, pinhole.pixels, pinhole.camera),
        "OPnP": functools.partial(opnp.solve, OBJECT, pinhole.pixels, pinhole.camera),
    }
    count = len(fisheye.pixels)
    return {name: 1e6 * times.cpu / count for name, times in zip(calls, in_turn(*calls.values()), strict=True)}


def _steps() -> dict[str, float]:
    draws = sim.draws("orthogonal", 1)
    found = {
        "EPOSIT": sim.eposit_exact(draws),
        "POSIT": eposit.solve(OBJECT, draws.pixels, draws.camera, "posit"),
        "EPOSIT, released": sim.as_released_exact(draws),
    }
    return {name: float(np.median(solution.iterations)) for name, solution in found.items()}


def _text(found: Cost) -> str:
    told = (f"{name} {found.steps[name]:.0f} iterations, {found.time_us[name]:.2g} us" for name in ("EPOSIT", "POSIT"))
    others = ", ".join(f"{name} {found.over(name):.0f}" for name in COMPARED)
    return f"{'; '.join(told)}; times as long take {others}"


def _released_text(found: Cost) -> str:
    name = "EPOSIT, released"
    return f"{found.steps[name]:.0f} iterations, {found.time_us[name]:.3g} us (in NumPy)"


def _is_efficient(found: Cost) -> bool:
    return all(found.over(name) > 1.0 for name in COMPARED) and found.steps["EPOSIT"] <= SIMILAR * found.steps["POSIT"]


STATEMENT = Statement(
    "II-B", "EPOSIT keeps POSIT's efficiency", "0.1 ms (IV)", _text, _released_text, holds_if(_is_efficient),
    "Per pose in a batch, processor time of calls in turn. Rectified once, the points are POSIT's, and so are the "
    "steps.", PART,
)  # fmt: skip
