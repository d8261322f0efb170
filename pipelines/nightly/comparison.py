"""One metric of two systems over the same poses: how much it changed, how well that is known, what it means."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from scipy import special

from eposit.arrays import Array, Mask
from pipelines.nightly.metrics import Kind, Metric

LEAST_POSES = 5  # below, a standard error of a mean is not known well enough to judge by
POWER_QUANTILE = 1.645  # normal quantile of 95 %: a change that large is seen on 95 of 100 nights


class Verdict(StrEnum):
    """What a comparison says of the candidate."""

    WORSE = "worse"
    BETTER = "better"
    EQUAL = "equal"  # shown to differ by less than the margin
    UNPROVED = "unproved"  # neither shown to differ nor to be equal


@dataclass(frozen=True, slots=True)
class Change:
    """Change of one metric in one slice from the baseline to the candidate, in the metric's unit.

    A CALIBRATION's numbers are logs of its mean; a LOGARITHM's are means of the logs.
    """

    metric: Metric
    poses: int
    old: float
    new: float
    effect: float
    error: float  # standard error of the effect
    freedom: float  # degrees of freedom of that error
    p: float  # of no change, two-sided
    toward_worse: bool

    @property
    def interval(self) -> tuple[float, float]:
        """Two-sided 95 % interval of the effect."""
        half = float(special.stdtrit(self.freedom, 0.975)) * self.error
        return self.effect - half, self.effect + half

    @property
    def is_equal(self) -> bool:
        """Whether two one-sided tests at 5 % show a change of less than the margin (Schuirmann 1987)."""
        return abs(self.effect) + float(special.stdtrit(self.freedom, 0.95)) * self.error < self.metric.margin

    def smallest_visible(self, alpha: float, tests: int) -> float:
        """Change that is seen in 95 of 100 such comparisons, `tests` of which share `alpha`; never below the margin."""
        seen = (float(special.stdtrit(self.freedom, 1.0 - alpha / (2.0 * tests))) + POWER_QUANTILE) * self.error
        return max(seen, self.metric.margin)


def compare_paired(metrics: Sequence[Metric], old: Array, new: Array) -> list[Change]:
    """Compare per-pose values of the same poses, NaN where a side has none; nothing below `LEAST_POSES` common poses.

    old, new: (m, n) for each metric and pose the mean over its frames and draws, which stay together since they share
    the pose and the noise; poses are independent.
    """
    both = np.isfinite(old) & np.isfinite(new)
    poses = np.sum(both, axis=1)
    ratio = np.array([metric.kind is Kind.CALIBRATION for metric in metrics])
    with np.errstate(invalid="ignore", divide="ignore"):  # metrics that are left out below
        (before, of_old), (after, of_new) = (_paired_side(ratio, side, both, poses) for side in (old, new))
        moved = of_new - of_old
        spread = np.where(both, moved - (np.sum(moved, axis=1) / poses)[:, None], 0.0)
        errors = np.sqrt(np.sum(spread**2, axis=1) / (poses - 1) / poses)
    sides = zip(metrics, before.tolist(), after.tolist(), errors.tolist(), poses.tolist(), strict=True)
    return [_change(*item[:4], item[4] - 1, item[4]) for item in sides if item[4] >= LEAST_POSES]


def _paired_side(ratio: Mask, values: Array, both: Mask, poses: Array) -> tuple[Array, Array]:
    """(m,) estimates and (m, n) how much each pose moves them, times the number of poses; as `_Side.of`."""
    known = np.where(both, values, 0.0)
    mean = np.sum(known, axis=1) / poses
    return np.where(ratio, np.log(mean), mean), np.where(ratio[:, None], known / mean[:, None], known)


def compare_unpaired(metric: Metric, old: Array, new: Array) -> Change | None:
    """Compare per-pose values of different poses, (n,) and (m,), with Welch's degrees of freedom (Welch 1947)."""
    old, new = old[np.isfinite(old)], new[np.isfinite(new)]
    if min(len(old), len(new)) < LEAST_POSES:
        return None
    before, after = _Side.of(metric, old), _Side.of(metric, new)
    parts = [float(np.var(side.influence, ddof=1)) / len(side.influence) for side in (before, after)]
    total = sum(parts)
    spread = sum(part**2 / (len(side.influence) - 1) for part, side in zip(parts, (before, after), strict=True))
    freedom = total**2 / spread if spread else float(min(len(old), len(new)) - 1)
    return _change(metric, before.estimate, after.estimate, float(np.sqrt(total)), freedom, min(len(old), len(new)))


@dataclass(frozen=True, slots=True)
class _Side:
    """One side's estimate and how much each pose moves it, times the number of poses."""

    estimate: float
    influence: Array

    @classmethod
    def of(cls, metric: Metric, values: Array) -> _Side:
        mean = float(np.mean(values))
        if metric.kind is Kind.CALIBRATION:  # to first order, log of a mean moves by the part of the mean
            return cls(float(np.log(mean)), values / mean)
        return cls(mean, values)


def _change(metric: Metric, old: float, new: float, error: float, freedom: float, poses: int) -> Change:
    effect = new - old
    worse = effect > 0.0 if metric.kind is Kind.LOGARITHM else abs(new) > abs(old)
    return Change(metric, poses, old, new, effect, error, freedom, _p_value(effect, error, freedom), worse)


def _p_value(effect: float, error: float, freedom: float) -> float:
    if error > 0.0:
        return float(2.0 * special.stdtr(freedom, -abs(effect) / error))
    return 1.0 if effect == 0.0 else 0.0  # the same numbers, or each moved by the same amount


def holm(p: Array, alpha: float) -> Mask:
    """(m,) which of m hypotheses are rejected at a family-wise level `alpha` (Holm 1979)."""
    order = np.argsort(p, kind="stable")
    within = p[order] <= alpha / (len(p) - np.arange(len(p)))
    count = len(p) if np.all(within) else int(np.argmin(within))
    rejected = np.zeros(len(p), np.bool_)
    rejected[order[:count]] = True
    return rejected


def verdicts(changes: list[Change], alpha: float) -> list[Verdict]:
    """What each change means, all of them one family: one counts if Holm rejects it and it is above its margin."""
    if not changes:
        return []
    rejected = holm(np.array([change.p for change in changes]), alpha)
    return [_verdict(change, bool(differs)) for change, differs in zip(changes, rejected, strict=True)]


def _verdict(change: Change, differs: bool) -> Verdict:
    if differs and abs(change.effect) > change.metric.margin:
        return Verdict.WORSE if change.toward_worse else Verdict.BETTER
    return Verdict.EQUAL if change.is_equal else Verdict.UNPROVED
