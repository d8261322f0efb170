"""Gate `data`: the pinned pictures are the ones that the baseline read."""

from __future__ import annotations

from pipelines.nightly.record import Exit, Outcome, State

GATE = "data"


def judge(found: str, wanted: str) -> Outcome:
    """Compare the content hashes of the pinned pictures, tonight's and the baseline's."""
    if found != wanted:
        told = "the pinned pictures are not the baseline's; restore them, or accept a new baseline"
        return Outcome(GATE, State.FAILED, told, Exit.NO_VERDICT)
    return Outcome(GATE, State.PASSED, f"the pinned pictures are the baseline's, content {found[:12]}")
