"""Gate `replay`: poses from points that never change, true ones and true ones with stored noise.

It tells whether the solver's numbers moved at all, and never fails by itself: another order of operations moves them,
and is no fault. Exact points alone would not show a solver that stops a step early.
"""

from __future__ import annotations

from collections.abc import Mapping

from pipelines.nightly.record import Outcome, State

GATE = "replay"


def judge(old: Mapping[str, str], new: Mapping[str, str]) -> Outcome:
    """Compare the digests of the poses, by suite and setting."""
    common = [name for name in new if name in old]
    if not common:
        return Outcome(GATE, State.NOT_RUN, "the baseline has no poses from true points")
    moved = [name for name in common if new[name] != old[name]]
    if moved:
        told = f"poses from unchanged points differ in {len(moved)} of {len(common)} settings: {', '.join(moved)}"
        return Outcome(GATE, State.CHANGED, told)
    return Outcome(GATE, State.PASSED, f"poses from unchanged points are the same bits in {len(common)} settings")
