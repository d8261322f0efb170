"""What section III-C and III-D of the paper share: the compared solvers, with those of today, and their tables."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial

import numpy as np

from eposit.arrays import Array
from pipelines.pages.sections import Drawing, Table
from pipelines.paper import simulation as sim
from pipelines.paper.claims import EQUATIONS, RELEASED, Verdict
from pipelines.paper.problems import NORMAL_MEDIAN, OBJECT, bounds, information
from pipelines.paper.simulation.plots import boxes
from pipelines.statistics import FEW, bootstrap, median, percent, percentile95, rate

OPNP_DRAWS = 5  # for OPnP, of which a pose takes milliseconds
STATISTICS: dict[str, Callable[[Array], Array]] = {"median": median, "95 %": percentile95}
HEAD = (
    "solver",
    "",
    *(f"{name}, {unit}" for name, unit in zip(sim.COMPONENTS, sim.UNITS, strict=True)),
    "no pose",
    "gross failure",
)
SOLVERS: dict[str, sim.Estimate] = {
    "EPOSIT, equations": sim.equations,
    "EPOSIT, released": sim.as_released,
    "EPOSIT, true camera": sim.eposit_exact,
    "OPnP": sim.with_opnp,
    "GPnPf": sim.with_gpnpf,
    "PnPfr, least distortion": sim.with_pnpfr,
    "PnPfr, first root": partial(sim.with_pnpfr_root, which="first"),
    "PnPfr, best root": partial(sim.with_pnpfr_root, which="best"),
    "ours (best)": sim.best,
    "OpenCV SQPNP": sim.named("opencv-sqpnp"),
    "OpenCV EPNP": sim.named("opencv-epnp"),
    "OpenCV P3P": sim.named("opencv-p3p"),
    "PoseLib p3p": sim.named("poselib-p3p"),
    "PoseLib p4pf": sim.named("poselib-p4pf"),
}
# The same point as principal point everywhere: what is compared under one assumption, in a table of its own.
SAME_POINT: dict[str, sim.Estimate] = {
    "EPOSIT, equations, image centre": sim.equations_at_centre,
    "EPOSIT, released, image centre": sim.as_released_at_centre,
    "EPOSIT, equations, principal point": sim.equations_from_principal_point,
    "EPOSIT, released, principal point": sim.as_released_from_principal_point,
    "GPnPf, principal point": sim.with_gpnpf_at_principal_point,
    "PnPfr, principal point": sim.with_pnpfr_at_principal_point,
}
PEERS = ("ours (best)", "OpenCV SQPNP")  # shown on the same draws, too
SIMILAR = 1.25  # ratio up to which two errors count as alike
SHOWN = ("EPOSIT, equations", "EPOSIT, released", "OPnP", "GPnPf", "PnPfr, least distortion", "ours (best)")


def outcomes(lens: str, solvers: dict[str, sim.Estimate], seeds: int) -> dict[str, sim.Outcome]:
    """What every solver makes of the draws; OPnP has fewer, on which its peers are shown, too."""
    few, many = sim.draws(lens, min(OPNP_DRAWS, seeds)), sim.draws(lens, seeds)
    families = {name.partition(",")[0] for name in solvers}
    found = {name: sim.outcome(few if name == "OPnP" else many, call) for name, call in solvers.items()}
    found |= {name: sim.outcome(many, call) for name, call in SAME_POINT.items() if name.partition(",")[0] in families}
    return found | {f"{name}, the draws of OPnP": sim.outcome(few, solvers[name]) for name in PEERS}


def items(
    figure: str, lens: str, found: dict[str, sim.Outcome], lines: dict[int, list[float]]
) -> tuple[Drawing | Table, ...]:
    """The section's figure and tables. lines: component to numbers that the paper states."""
    rows: list[tuple[str, ...]] = []
    each = {name: outcome for name, outcome in found.items() if name not in SAME_POINT}
    for name, outcome in each.items():
        failures = [percent(rate(mask.T)) for mask in (outcome.failed, outcome.gross_failure)]
        for label, statistic in STATISTICS.items():
            cells = (bootstrap(_by_pose(np.abs(outcome.error[..., k])), statistic, resamples=FEW) for k in range(6))
            rows.append((name, label, *(cell.text(3) for cell in cells), *failures))
    shown = {name: found[name].error.reshape(-1, 6) for name in SHOWN if name in found}
    return (
        Drawing(f"{figure}: errors, all draws", boxes(shown, lines, limits=True)),
        Table(
            "Medians and 95th percentiles of |error| where there is a pose, with 95 % intervals over the poses", HEAD,
            tuple(rows), "Gross failure, the paper's star: no pose, or a position at least twice as far as the true "
            "one.",
        ),
        _same_point(found),
        _against_bound(lens, each),
    )  # fmt: skip


def _same_point(found: dict[str, sim.Outcome]) -> Table:
    """Medians of the solvers that are compared under one assumption."""
    rows = [
        (alike.point, name, *(f"{median_of(outcome, k):.3g}" for k in range(6)), percent(rate(outcome.gross_failure.T)))
        for alike in Alike.both(found)
        for name, outcome in alike.rows.items()
    ]
    return Table(
        "The same point as principal point for all: medians of |error|",
        ("principal point", "solver", *HEAD[2:8], "gross failure"), tuple(rows),
        "Everywhere, in theta as in x and y. The true one is what a calibration tells; the image centre needs none.",
    )  # fmt: skip


def _against_bound(lens: str, found: dict[str, sim.Outcome]) -> Table:
    """Median of |error| over each pose's own bound, which is 0.6745 for a solver that reaches it."""
    problem = sim.draws(lens, 1)
    bound = bounds(information(problem.camera, OBJECT, problem.pose))
    head = ("solver", "turn x", "turn y", "turn z", "x", "y", "z")
    rows: list[tuple[str, ...]] = []
    for name, outcome in found.items():
        ratio = np.abs(outcome.vector.reshape(len(outcome.failed), -1, 6)) / bound
        cells = (bootstrap(_by_pose(ratio[..., k]), median, resamples=FEW) for k in range(6))
        rows.append((name, *(cell.text(3) for cell in cells)))
    return Table(
        f"Median of |error| over the frame's Cramer-Rao bound; {NORMAL_MEDIAN:.4f} reaches it", head, tuple(rows),
        "Solvers with a nominal focal length have its bias in here.",
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Alike:
    """EPOSIT and the solvers that estimate the focal length, all with the same point as principal point."""

    point: str  # in words
    equations: sim.Outcome
    released: sim.Outcome
    others: dict[str, sim.Outcome]

    @property
    def rows(self) -> dict[str, sim.Outcome]:
        """All of them by name."""
        return {"EPOSIT, equations": self.equations, "EPOSIT, released": self.released, **self.others}

    @staticmethod
    def both(found: dict[str, sim.Outcome]) -> tuple[Alike, Alike]:
        """With the image centre, as a user without calibration has it, and with the true principal point."""
        return Alike._about("image centre", "PnPfr, least distortion", found), Alike._about(
            "principal point", "PnPfr, principal point", found
        )

    @staticmethod
    def _about(point: str, pnpfr: str, found: dict[str, sim.Outcome]) -> Alike:
        others = {"PnPfr": found[pnpfr]}
        gpnpf = "GPnPf" if point == "image centre" else f"GPnPf, {point}"
        if gpnpf in found:
            others["GPnPf"] = found[gpnpf]
        equations, released = (found[f"EPOSIT, {method}, {point}"] for method in (EQUATIONS, RELEASED))
        return Alike(point, equations, released, others)


def told_alike(both: Iterable[Alike], method: str, told: Callable[[sim.Outcome], str]) -> str:
    """The figures of EPOSIT by a method and of the others, for each of the two points."""
    return "; ".join(
        f"{alike.point}: EPOSIT {told(getattr(alike, method))}, "
        + ", ".join(f"{name} {told(outcome)}" for name, outcome in alike.others.items())
        for alike in both
    )


def judged_alike(both: Iterable[Alike], is_better: Callable[[sim.Outcome, sim.Outcome], bool]) -> Verdict:
    """Whether EPOSIT is better than each of the others: with both points, with one, or with none."""
    held = [all(is_better(alike.equations, other) for other in alike.others.values()) for alike in both]
    return (Verdict.FAILS, Verdict.PARTLY, Verdict.HOLDS)[sum(held)]


def _by_pose(values: Array) -> Array:
    """(poses, seeds), so that the draws of a pose stay together."""
    return values.T


def errors_text(outcome: sim.Outcome) -> str:
    """Medians of the three angles and of z."""
    rx, ry, rz = (median_of(outcome, k) for k in range(3))
    z = bootstrap(_by_pose(np.abs(outcome.error[..., 5])), median, resamples=FEW)
    return f"{rx:.3f}/{ry:.3f}/{rz:.3f} deg, z {z.text(3)} mm"


def turn_text(outcome: sim.Outcome) -> str:
    """Medians of the three angles."""
    return "/".join(f"{median_of(outcome, k):.2f}" for k in range(3)) + " deg"


def gross_failures_text(outcome: sim.Outcome) -> str:
    """Their share."""
    return f"{percent(rate(outcome.gross_failure.T))} gross failures"


def median_of(outcome: sim.Outcome, k: int) -> float:
    """Median of |error| of component k."""
    return float(np.nanmedian(np.abs(outcome.error[..., k])))
