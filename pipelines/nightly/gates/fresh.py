"""Gate `fresh`: views of tonight's seed, which no code was tuned on, read by the candidate and by the baseline's code.

A change is believed if it shows twice: on tonight's views, and on others drawn for the flagged metrics only. So the
first look may be bold (5 % of nights flag something by chance) without false alarms, and sees smaller changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from pipelines.nightly.comparison import Verdict, verdicts
from pipelines.nightly.gates.accuracy import Waived, failed
from pipelines.nightly.judgement import Finding, Judgement
from pipelines.nightly.record import Outcome, State

GATE = "fresh"
ALPHA = 0.05


def judge(first: Judgement, again: Callable[[], Judgement], waived: Waived) -> Outcome:
    """Flag on the first views, confirm on others. again: a comparison on views of another seed, made only if needed."""
    flagged = first.of(Verdict.WORSE)
    if not flagged:
        return Outcome(GATE, State.PASSED, f"none of {len(first.findings)} metrics is worse on views of tonight's seed")
    confirmed = confirm(flagged, again().findings)
    if not confirmed:
        told = f"{len(flagged)} metrics looked worse on tonight's views and not on others, as chance does"
        return Outcome(GATE, State.PASSED, told, findings=tuple(flagged))
    return failed(GATE, confirmed, waived)


def confirm(flagged: Iterable[Finding], again: Iterable[Finding]) -> list[Finding]:
    """Findings of the second views that are worse, of the flagged ones alone, which are a family of their own."""
    wanted = {(item.slice, item.change.metric.name) for item in flagged}
    looked_at = [item for item in again if (item.slice, item.change.metric.name) in wanted]
    meant = verdicts([item.change for item in looked_at], ALPHA)
    return [
        Finding(item.slice, item.change, verdict)
        for item, verdict in zip(looked_at, meant, strict=True)
        if verdict is Verdict.WORSE
    ]
