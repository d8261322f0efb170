"""Gate `tail`: how often an error exceeds the baseline's 95th percentile, which a mean does not show.

The percentile is the baseline's own on the same pictures, so a twentieth of its frames are beyond it. Frames of all
cameras are counted together, each against its own camera's percentile.
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pyarrow as pa
from scipy import stats

from eposit.arrays import Mask
from pipelines.nightly.comparison import holm
from pipelines.nightly.gates.accuracy import Waived
from pipelines.nightly.measures import Slice, slices
from pipelines.nightly.record import Exit, Outcome, State

GATE = "tail"
ALPHA = 0.01  # over all systems and metrics
METRICS = ("corner_log_ms", "pose_log_t", "pose_log_R")  # errors that have a size
LEAST_FRAMES = 400  # below, an exact test sees only tails that are twice as heavy
PERCENT = 95.0


def judge(old: pa.Table, new: pa.Table, waived: Waived) -> Outcome:
    """Compare two tables of measures of the same frames. A heavier tail fails unless it is waived."""
    return judge_slices(slices(old), slices(new), waived)


def judge_slices(old: list[Slice], new: list[Slice], waived: Waived) -> Outcome:
    """The same for the slices of two tables."""
    pooled = _exceedances(old, new)
    if not pooled:
        return Outcome(GATE, State.NOT_RUN, f"no system has {LEAST_FRAMES} frames, fewer than tails need")
    p = np.array([_p_value(before, after) for before, after in pooled.values()])
    heavier = [name for name, worse in zip(pooled, holm(p, ALPHA), strict=True) if worse]
    if not heavier:
        return Outcome(GATE, State.PASSED, f"no tail of {len(pooled)} is heavier than the baseline's")
    left = [name for name in heavier if not waived(*name)] or heavier
    system, metric = left[0]
    before, after = (int(np.sum(side)) for side in pooled[left[0]])
    more = f"; {len(left) - 1} more" if len(left) > 1 else ""
    told = f"{metric} of {system}: {after} frames exceed the baseline's percentile, which {before} of its own do{more}"
    if all(waived(*name) for name in heavier):
        return Outcome(GATE, State.WAIVED, f"accepted: {told}")
    return Outcome(GATE, State.FAILED, told, Exit.WORSE)


def _p_value(before: Mask, after: Mask) -> float:
    up, down = int(np.sum(after & ~before)), int(np.sum(before & ~after))
    return float(stats.binomtest(up, up + down, 0.5, alternative="greater").pvalue) if up + down else 1.0


def _exceedances(old: list[Slice], new: list[Slice]) -> dict[tuple[str, str], tuple[Mask, Mask]]:
    """(system with regime, metric) to which frames exceed the baseline's percentile, on either side."""
    baseline, parts = {item.name: item for item in old}, defaultdict(list)
    for item in new:
        before = baseline.get(item.name)
        for metric in METRICS:
            if before is not None and metric in item.values and metric in before.values:
                parts[f"{item.regime}/{item.system}", metric].append(_beyond(before, item, metric))
    joined = {name: tuple(np.concatenate(sides) for sides in zip(*found, strict=True)) for name, found in parts.items()}
    return {name: (sides[0], sides[1]) for name, sides in joined.items() if len(sides[0]) >= LEAST_FRAMES}


def _beyond(old: Slice, new: Slice, metric: str) -> tuple[Mask, Mask]:
    _, of_old, of_new = np.intersect1d(old.frame_id, new.frame_id, return_indices=True)
    before, after = old.values[metric][of_old], new.values[metric][of_new]
    both = np.isfinite(before) & np.isfinite(after)
    limit = np.percentile(before[both], PERCENT) if np.any(both) else np.inf
    return before[both] > limit, after[both] > limit
