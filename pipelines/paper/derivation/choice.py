"""How PnPfr chooses among its solutions: how many there are, and what can tell them apart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eposit import pnpfr
from pipelines.pages.sections import Table
from pipelines.paper import simulation as sim
from pipelines.paper.claims import Claim, Statement, Verdict
from pipelines.paper.problems import EXACT_RAD, OBJECT
from pipelines.statistics import Interval, percent, rate

PART = "derivation"
REPRODUCED_PX = 1e-6  # reprojection error below which a solution reproduces its points: rounding leaves 1e-12


@dataclass(frozen=True, slots=True)
class Roots:
    """PnPfr's solutions on the fish-eye's draws."""

    several: Interval  # share of frames with more than one
    most: int
    miss_px: float  # the largest reprojection error of any of them
    chosen: Interval  # share of those frames in which the one of least distortion is the nearest to the truth


def measure(seeds: int) -> tuple[tuple[Table, ...], tuple[Claim, ...]]:
    """The claim, on the draws of the orthogonal fish-eye."""
    return (), (STATEMENT.judged(_roots(sim.draws("orthogonal", seeds))),)


def _roots(draws: sim.Draws) -> Roots:
    found = pnpfr.solve(OBJECT, draws.pixels, draws.nominal)
    poses, cost = found.candidates.poses, found.candidates.cost
    usable = np.isfinite(cost)
    several = usable.sum(axis=1) > 1
    with np.errstate(invalid="ignore"):
        far = np.where(usable, np.linalg.norm(poses.R - draws.pose.R[:, None], axis=(2, 3)), np.inf)
        chosen = np.linalg.norm(found.cam_from_obj.R - draws.pose.R, axis=(1, 2))
    nearest = chosen <= far.min(axis=1) + EXACT_RAD
    by_pose = several.reshape(draws.seeds, -1).T.astype(np.float64)
    told = np.where(several, nearest, np.nan).reshape(draws.seeds, -1).T
    miss = float(np.sqrt(np.nanmax(cost, initial=0.0)))
    return Roots(rate(by_pose), int(usable.sum(axis=1).max()), miss, rate(told))


def _text(roots: Roots) -> str:
    return (
        f"more than one in {percent(roots.several)} of the frames, up to {roots.most}; reprojection error of each at "
        f"most {roots.miss_px:.1g} px"
    )


def _verdict(roots: Roots) -> Verdict:
    if roots.several.value == 0.0:
        return Verdict.FAILS
    return Verdict.HOLDS if roots.miss_px > REPRODUCED_PX else Verdict.PARTLY


STATEMENT = Statement(
    "I", "PnPfr needs an additional constraint, such as the least reprojection error, to choose a solution", "-", _text,
    "not concerned", _verdict,
    lambda roots: "It needs one. But four points are 8 equations for its 8 unknowns: each solution reproduces them, "
    "and their reprojection error cannot tell; a fifth point or a rule must. Least distortion, our rule, takes the "
    f"nearest to the truth in {percent(roots.chosen)} of these frames.", PART,
)  # fmt: skip
