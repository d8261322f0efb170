"""Gate `failures`: frames without corners, or without a pose, that had them before.

On the pinned pictures a new failure is a fact and no sample: nothing but the code has changed. On fresh views it may be
chance, and only counts can be compared.
"""

from __future__ import annotations

from collections.abc import Callable

from scipy import stats

from pipelines.nightly.judgement import Failures, Judgement
from pipelines.nightly.record import Exit, Outcome, State

GATE = "failures"
ALPHA = 0.01  # of the exact test on fresh views
MOST_NAMED = 8

Waived = Callable[[str, int], bool]  # whether a failure in a slice, of a frame, has been accepted


def judge(pinned: Judgement, fresh: Judgement | None, waived: Waived) -> Outcome:
    """Any new failure on the pinned pictures fails unless it is waived; on fresh views more than chance explains."""
    new = [(item.slice, frame) for item in pinned.failures for frame in item.new]
    accepted = [(name, frame) for name, frame in new if waived(name, frame)]
    open_ones = [item for item in new if item not in accepted]
    if open_ones:
        frames = tuple(dict.fromkeys(("pinned", frame) for _, frame in open_ones))
        return Outcome(GATE, State.FAILED, _named(open_ones), Exit.WORSE, frames=frames)
    if fresh is not None and (p := exact_p(fresh.failures)) <= ALPHA:
        count = sum(len(item.new) for item in fresh.failures)
        told = f"{count} fresh frames fail that the baseline's code reads, more than chance explains (p = {p:.2g})"
        frames = tuple(("fresh", frame) for item in fresh.failures for frame in item.new)
        return Outcome(GATE, State.FAILED, told, Exit.WORSE, frames=frames)
    if accepted:
        return Outcome(GATE, State.WAIVED, f"{len(accepted)} new failures, all of them accepted")
    mended = sum(len(item.mended) for item in pinned.failures)
    if mended:
        return Outcome(GATE, State.CHANGED, f"{mended} frames that failed no longer do")
    return Outcome(GATE, State.PASSED, "no frame fails that did not fail before")


def exact_p(failures: tuple[Failures, ...]) -> float:
    """Of the candidate failing as often as the baseline, one-sided, over all slices (McNemar 1947, exact)."""
    new, mended = (sum(len(getattr(item, side)) for item in failures) for side in ("new", "mended"))
    return float(stats.binomtest(new, new + mended, 0.5, alternative="greater").pvalue) if new + mended else 1.0


def _named(items: list[tuple[str, int]]) -> str:
    shown = ", ".join(f"frame {frame} in {name}" for name, frame in items[:MOST_NAMED])
    more = f" and {len(items) - MOST_NAMED} more" if len(items) > MOST_NAMED else ""
    return f"{len(items)} new failure{'s' if len(items) > 1 else ''}: {shown}{more}"
