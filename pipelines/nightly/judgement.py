"""Two tables of measures against each other: what changed in which slice, and which frames fail anew."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from scipy import stats

from eposit.arrays import Mask
from pipelines.nightly.comparison import Change, Verdict, compare_paired, compare_unpaired, verdicts
from pipelines.nightly.measures import Slice, slices
from pipelines.nightly.metrics import METRICS


@dataclass(frozen=True, slots=True)
class Finding:
    """One metric in one slice."""

    slice: str
    change: Change
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Failures:
    """Frames of one slice that have corners, a pose, or one of a metric's numbers on one side only.

    A number that is gone counts: without it, means over what is left would flatter the candidate.
    """

    slice: str
    frames: int
    new: tuple[int, ...]  # frame_id: the candidate fails where the baseline did not
    mended: tuple[int, ...]

    @property
    def p(self) -> float:
        """Of new and mended failures being equally likely, two-sided (McNemar 1947, exact)."""
        count = len(self.new) + len(self.mended)
        return float(stats.binomtest(len(self.new), count, 0.5).pvalue) if count else 1.0


@dataclass(frozen=True, slots=True)
class Judgement:
    """Everything that a comparison found."""

    findings: tuple[Finding, ...]
    failures: tuple[Failures, ...]
    paired: bool  # the same frames on both sides
    identical: bool  # and the same numbers in all of them
    lost: tuple[str, ...]  # slice and metric that the baseline has in some frame and the candidate in none
    only_old: tuple[str, ...]  # slices that one side lacks
    only_new: tuple[str, ...]

    def of(self, verdict: Verdict) -> list[Finding]:
        """Findings of one kind, the largest change beside its margin first."""
        own = [finding for finding in self.findings if finding.verdict is verdict]
        return sorted(own, key=lambda item: -abs(item.change.effect) / item.change.metric.margin)

    @property
    def new_failures(self) -> int:
        """Frames that fail anew, over all slices; without pairs there are none to name."""
        return sum(len(item.new) for item in self.failures)


def judge(old: pa.Table, new: pa.Table, alpha: float, paired: bool) -> Judgement:
    """Compare two tables of `measures.SCHEMA`.

    alpha: family-wise level over all slices and metrics. paired: both hold the same frames, by `frame_id`; without it
    the poses are different samples, which hides more, and frames cannot be compared one by one.
    """
    return judge_slices(slices(old), slices(new), alpha, paired)


def judge_slices(old: Sequence[Slice], new: Sequence[Slice], alpha: float, paired: bool) -> Judgement:
    """The same for the slices of two tables."""
    before, after = ({item.name: item for item in side} for side in (old, new))
    common = [name for name in after if name in before]
    found = [(name, change) for name in common for change in _changes(before[name], after[name], paired)]
    meant = verdicts([change for _, change in found], alpha)
    findings = tuple(Finding(name, change, verdict) for (name, change), verdict in zip(found, meant, strict=True))
    failures = tuple(_failures(before[name], after[name]) for name in common) if paired else ()
    lost = tuple(
        f"{name} {metric}" for name in common for metric in before[name].values if metric not in after[name].values
    )
    only = [tuple(name for name in one if name not in other) for one, other in ((before, after), (after, before))]
    identical = paired and not any(only) and all(_same(before[name], after[name]) for name in common)
    return Judgement(findings, failures, paired, identical, lost, *only)


def _changes(old: Slice, new: Slice, paired: bool) -> list[Change]:
    names = [name for name in new.values if name in old.values]
    metrics = [METRICS[name] for name in names]
    if paired:
        poses = np.intersect1d(old.pose_id, new.pose_id)
        return compare_paired(metrics, old.by_pose(names, poses), new.by_pose(names, poses))
    found: list[Change] = []
    for metric in metrics:
        own = (side.by_pose([metric.name], np.unique(side.pose_id))[0] for side in (old, new))
        change = compare_unpaired(metric, *own)
        found += [] if change is None else [change]
    return found


def _failures(old: Slice, new: Slice) -> Failures:
    frames, of_old, of_new = np.intersect1d(old.frame_id, new.frame_id, return_indices=True)
    before, after = old.failed[of_old], new.failed[of_new]
    gone, come = after & ~before, before & ~after
    names = list(old.values)  # a metric that is wholly new mends nothing
    has, has_now = (side.has(names)[:, of] for side, of in ((old, of_old), (new, of_new)))
    gone, come = gone | np.any(has & ~has_now, axis=0), come | np.any(has_now & ~has, axis=0)
    return Failures(new.name, len(frames), _ids(frames, gone), _ids(frames, come & ~gone))


def _ids(frames: NDArray[np.int64], chosen: Mask) -> tuple[int, ...]:
    return tuple(int(frame) for frame in frames[chosen])


def _same(old: Slice, new: Slice) -> bool:
    if old.values.keys() != new.values.keys() or not np.array_equal(old.frame_id, new.frame_id):
        return False
    equal = all(np.array_equal(old.values[name], new.values[name], equal_nan=True) for name in old.values)
    return equal and bool(np.array_equal(old.failed, new.failed))
