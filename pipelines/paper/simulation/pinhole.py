"""Section III-C of the paper: the comparison for the pinhole camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipelines.paper import simulation as sim
from pipelines.paper.claims import EQUATIONS, RELEASED, PaperSection, Statement, Verdict, holds_if, judged
from pipelines.paper.simulation.comparison import (
    SIMILAR,
    SOLVERS,
    Alike,
    errors_text,
    gross_failures_text,
    items,
    judged_alike,
    median_of,
    outcomes,
    told_alike,
    turn_text,
)

INTRO = (
    "The perspective lens. EPOSIT has the paper's camera: nominal focal length, true principal point subtracted from x "
    "and y. OPnP and the solvers in the lower rows have the true camera, GPnPf and PnPfr the image centre; a "
    "table of its own compares them under the same assumption."
)


@dataclass(frozen=True, slots=True)
class Pinhole:
    """Outcomes of the solvers that the paper compares, and of all."""

    every: dict[str, sim.Outcome]

    @property
    def ours(self) -> sim.Outcome:
        """EPOSIT by the paper's equations."""
        return self.every["EPOSIT, equations"]

    @property
    def released(self) -> sim.Outcome:
        """EPOSIT as released."""
        return self.every["EPOSIT, released"]

    @property
    def opnp(self) -> sim.Outcome:
        """OPnP, on the first draws only."""
        return self.every["OPnP"]

    @property
    def unknown_focal(self) -> dict[str, sim.Outcome]:
        """The solvers that estimate the focal length."""
        return {name: self.every[name] for name in ("GPnPf", "PnPfr, least distortion")}

    @property
    def alike(self) -> tuple[Alike, Alike]:
        """EPOSIT and those with the same principal point."""
        return Alike.both(self.every)

    def share_opnp_worse(self, other: sim.Outcome) -> float:
        """Share of OPnP's frames whose rotation errors are larger than another's."""
        few = len(self.opnp.failed)
        ours, theirs = (np.abs(error[..., :3]).sum(-1) for error in (self.opnp.error, other.error[:few]))
        return float(np.mean(ours > theirs))


def pinhole(seeds: int) -> PaperSection:
    """The pinhole comparison."""
    found = outcomes("perspective", SOLVERS, seeds)
    shown = items("The paper's figure 6", "perspective", found, {})
    return PaperSection("Comparison for the pinhole camera (III-C)", INTRO, shown, judged(STATEMENTS, Pinhole(found)))


def _bias(found: Pinhole) -> str:
    ours, opnp = (np.nanmean(outcome.error[..., 5]) for outcome in (found.ours, found.opnp))
    return f"z bias {ours:.3g} mm (OPnP {opnp:.2g} mm)"


def _unknown_focal_text(found: Pinhole) -> str:
    return "; ".join(f"{name}: {errors_text(outcome)}" for name, outcome in found.unknown_focal.items())


def _least_unknown_focal(found: Pinhole) -> float:
    return min(median_of(outcome, 0) for outcome in found.unknown_focal.values())


def _unknown_focal_failures(found: Pinhole) -> str:
    return ", ".join(f"{name}: {gross_failures_text(outcome)}" for name, outcome in found.unknown_focal.items())


def _turn(outcome: sim.Outcome) -> float:
    """Root of the summed squares of the three angles' medians, deg."""
    return float(np.hypot.reduce([median_of(outcome, k) for k in range(3)]))


STATEMENTS: tuple[Statement[Pinhole], ...] = (
    Statement(
        "III-C", "EPOSIT performs best of all on the pinhole camera", "-",
        lambda found: errors_text(found.ours), lambda found: errors_text(found.released),
        holds_if(lambda f: median_of(f.ours, 0) <= min(median_of(outcome, 0) for outcome in f.every.values())),
        lambda found: f"OPnP: {errors_text(found.opnp)}. With accurate intrinsics OPnP is about twice as good in "
        f"rotation and several times in z, where EPOSIT has the bias of its focal length: {_bias(found)}.", "pinhole",
    ),
    Statement(
        "III-C", "OPnP is similar, but at some points worse than EPOSIT", "some points",
        lambda found: f"OPnP's rotation is worse in {100 * found.share_opnp_worse(found.ours):.0f} % of the frames",
        lambda found: f"in {100 * found.share_opnp_worse(found.released):.0f} %",
        holds_if(
            lambda f: f.share_opnp_worse(f.ours) > 0.0 and median_of(f.ours, 0) < SIMILAR * median_of(f.opnp, 0),
            Verdict.PARTLY,
        ),
        "Of two noisy solvers the better one loses single frames; it wins the others.", "pinhole",
    ),
    Statement(
        "III-C", "OPnP is better than GPnPf and PnPfr, since it knows the intrinsics", "-", _unknown_focal_text,
        "not concerned", holds_if(lambda found: median_of(found.opnp, 0) < _least_unknown_focal(found)),
        lambda found: f"OPnP: {errors_text(found.opnp)}.", "pinhole",
    ),
    Statement(
        "III-C", "OPnP has abnormal solutions through noise", "stars in its plots",
        lambda found: gross_failures_text(found.opnp), "not concerned",
        holds_if(lambda found: bool(np.any(found.opnp.gross_failure))),
        "None in our draws: all 40 pairs of solutions are found and the one of lowest cost is taken.", "pinhole",
    ),
    Statement(
        "III-C", "GPnPf and PnPfr are less accurate than EPOSIT", "-",
        lambda found: told_alike(found.alike, EQUATIONS, turn_text),
        lambda found: told_alike(found.alike, RELEASED, turn_text),
        lambda found: judged_alike(found.alike, lambda ours, other: _turn(ours) < _turn(other)),
        lambda found: f"Medians of the three angles, all solvers with the same principal point, both ways. "
        f"{_unknown_focal_failures(found)}. They estimate what EPOSIT is told, focal length and distortion, from four "
        "points.", "pinhole",
    ),
    Statement(
        "III-C", "EPOSIT is robust: no abnormal solution", "no stars",
        lambda found: gross_failures_text(found.ours), lambda found: gross_failures_text(found.released),
        holds_if(lambda found: not np.any(found.ours.gross_failure)),
        "On this helix; beyond 54.7 degrees off the axis it has no solution at all: see `beyond`.", "pinhole",
    ),
)  # fmt: skip
