"""Gate `data`: the pinned pictures are the ones that the baseline read."""

from __future__ import annotations

from collections.abc import Mapping

from pipelines.nightly.record import Exit, Outcome, State

GATE = "data"


def judge(found: Mapping[str, str], wanted: Mapping[str, str]) -> Outcome:
    """Compare content hashes of the frames, by suite. wanted: the baseline's."""
    other = [name for name, digest in wanted.items() if found.get(name) != digest]
    new = [name for name in found if name not in wanted]
    if other:
        told = f"the pictures of {', '.join(other)} are not the baseline's; restore them, or accept a new baseline"
        return Outcome(GATE, State.FAILED, told, Exit.NO_VERDICT)
    if new:
        told = f"the baseline has no pictures of {', '.join(new)}; accept a new baseline"
        return Outcome(GATE, State.FAILED, told, Exit.NO_VERDICT)
    return Outcome(GATE, State.PASSED, f"the pictures of {', '.join(found)} are the baseline's, by their content hash")
