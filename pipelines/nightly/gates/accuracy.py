"""Gate `accuracy`: the pinned pictures as the candidate reads them against the frozen baseline, frame by frame."""

from __future__ import annotations

from collections.abc import Callable

from pipelines.nightly.comparison import Verdict
from pipelines.nightly.judgement import Finding, Judgement
from pipelines.nightly.record import Exit, Outcome, State

GATE = "accuracy"
ALPHA = 0.01  # chance of a false alarm a night, over all slices and metrics


Waived = Callable[[str, str], bool]  # whether somebody has accepted a metric in a slice


def judge(found: Judgement, waived: Waived) -> Outcome:
    """Worse fails, unless it is waived; what is neither shown to be worse nor to be equal warns."""
    if found.identical:
        return Outcome(GATE, State.PASSED, "every number of every frame is the same as the baseline's")
    worse, unproved, better = (found.of(v) for v in (Verdict.WORSE, Verdict.UNPROVED, Verdict.BETTER))
    if worse:
        return failed(GATE, worse, waived)
    if found.only_old or found.only_new:
        return Outcome(GATE, State.WARNED, _of_one_side(found), findings=tuple(unproved))
    if unproved:
        told = f"{len(unproved)} of {len(found.findings)} metrics are neither shown to be worse nor to be equal"
        return Outcome(GATE, State.WARNED, told, findings=tuple(unproved))
    if better:
        return Outcome(GATE, State.CHANGED, describe(better), findings=tuple(better))
    return Outcome(GATE, State.PASSED, f"all {len(found.findings)} metrics are equal within their margins")


def _of_one_side(found: Judgement) -> str:
    told: list[str] = []
    if found.only_old:
        told.append(f"not read tonight, though the baseline has them: {', '.join(found.only_old)}")
    if found.only_new:
        told.append(f"not judged until a run with them is accepted: {', '.join(found.only_new)}")
    return "; ".join(told)


def failed(gate: str, worse: list[Finding], waived: Waived) -> Outcome:
    """The outcome of a gate that found something worse: waived if all of it is."""
    left = [item for item in worse if not waived(item.slice, item.change.metric.name)]
    if left:
        return Outcome(gate, State.FAILED, describe(left), Exit.WORSE, tuple(left))
    return Outcome(gate, State.WAIVED, f"accepted: {describe(worse)}", findings=tuple(worse))


def describe(findings: list[Finding]) -> str:
    """The first finding with its numbers, and how many more there are."""
    first = findings[0]
    change, unit = first.change, first.change.metric.unit
    low, high = change.interval
    number = f"{change.effect:+.2g} [{low:+.2g}, {high:+.2g}]{'' if unit == '1' else ' ' + unit}"
    more = f"; {len(findings) - 1} more" if len(findings) > 1 else ""
    return (
        f"{change.metric.name} in {first.slice} is {first.verdict} by {number}, margin {change.metric.margin:.2g}{more}"
    )
