"""Gate `replay`: poses from points that never change, true ones and true ones with stored noise.

It tells whether the solver's numbers moved at all, how far, and what else is other than in the baseline's run. It
never fails by itself: another order of operations moves them, and is no fault. Exact points alone would not show a
solver that stops a step early.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pyarrow as pa

from pipelines.nightly.differences import told
from pipelines.nightly.measures import Slice, slices
from pipelines.nightly.record import Outcome, State

GATE = "replay"
NOISY = "truth+"  # in the name of a system whose points are true ones with noise
LENGTHS = ("pose_log_t", "pose_log_R")  # not over deviations: a covariance is good to a thousandth, poses to rounding


def judge(old: Mapping[str, str], new: Mapping[str, str], share: float, reasons: Sequence[str]) -> Outcome:
    """Compare the digests of the poses, by suite and setting.

    share: by which errors of noisy poses change, as `largest_change` tells. reasons: what is not as in the baseline's
        run.
    """
    common = [name for name in new if name in old]
    if not common:
        return Outcome(GATE, State.NOT_RUN, "the baseline has no poses from true points")
    moved = [name for name in common if new[name] != old[name]]
    if moved:
        sentence = (
            f"poses from unchanged points differ in {len(moved)} of {len(common)} settings, errors of those from noisy "
            f"points by at most {share:.1g} of themselves{told(reasons)}"
        )
        return Outcome(GATE, State.CHANGED, sentence)
    return Outcome(GATE, State.PASSED, f"poses from unchanged points are the same bits in {len(common)} settings")


def largest_change(old: pa.Table, new: pa.Table) -> float:
    """Of the errors of poses from true points with noise, as a share; NaN without any. old, new: tables of measures."""
    before = {item.name: item for item in slices(old) if NOISY in item.system}
    changes = [_change(before[item.name], item) for item in slices(new) if item.name in before]
    return max((change for change in changes if np.isfinite(change)), default=float("nan"))


def _change(old: Slice, new: Slice) -> float:
    _, of_old, of_new = np.intersect1d(old.frame_id, new.frame_id, return_indices=True)
    names = [name for name in LENGTHS if name in old.values and name in new.values]
    changes = [np.abs(np.expm1(new.values[name][of_new] - old.values[name][of_old])) for name in names]
    return float(np.nanmax(changes)) if changes and np.any(np.isfinite(changes)) else float("nan")
