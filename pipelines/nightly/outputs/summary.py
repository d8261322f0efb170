"""summary.md: the night on one screen, for the step summary of a build server or a chat, always below 64 kB.

Every text is cut, names to `LONGEST_NAME` and others to `LONGEST` characters, and every list to a few entries, so its
size does not depend on the night.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from pipelines.nightly.gates.accuracy import describe
from pipelines.nightly.outputs.results import Results
from pipelines.nightly.record import Exit, State

LONGEST, LONGEST_NAME = 300, 60  # characters; each takes 5 bytes at most, escaped
MOST_CHANGES = 5
MOST_GATES = 20
HEADLINES = {
    Exit.FINE: "fine",
    Exit.WORSE: "worse",
    Exit.USAGE: "wrong use",
    Exit.NO_VERDICT: "no verdict",
    Exit.COULD_NOT_RUN: "could not run",
}


def text(results: Results, report: str) -> str:
    """The summary as Markdown. report: address of the page."""
    night = results.night
    recipe, run, baseline = (_plain(name, LONGEST_NAME) for name in (night.recipe, night.run_id, night.baseline))
    lines = [
        f"## Nightly {recipe}: {HEADLINES[night.exit]}",
        "",
        _plain(night.sentence),
        "",
        f"Exit code {int(night.exit)}, run {run}, baseline {baseline}. [Report](<{report}>)",
        "",
        *_gates(results),
        "",
        *_changes(results),
    ]
    return "\n".join(lines) + "\n"


def _gates(results: Results) -> Iterator[str]:
    yield "| gate | result | what was found |"
    yield "|---|---|---|"
    outcomes = results.night.outcomes
    for outcome in outcomes[:MOST_GATES]:
        state = f"**{outcome.state}**" if outcome.state is State.FAILED else str(outcome.state)
        yield f"| {_plain(outcome.gate, LONGEST_NAME)} | {state} | {_plain(outcome.sentence)} |"
    if len(outcomes) > MOST_GATES:
        yield f"| {len(outcomes) - MOST_GATES} more | | |"


def _changes(results: Results) -> Iterator[str]:
    changes = results.changes()
    yield "### Changes" if changes else "No metric is shown to have changed."
    if changes:
        yield ""
    for suite, item in changes[:MOST_CHANGES]:
        visible = results.smallest_visible(suite, item)
        told = f"{describe([item])}, smallest visible {visible:.2g} ({suite} suite, {item.change.poses} poses)"
        yield f"- {_plain(told)}"
    if len(changes) > MOST_CHANGES:
        yield f"- {len(changes) - MOST_CHANGES} more"


def _plain(text: str, longest: int = LONGEST) -> str:
    """A text on one line, cut, in which Markdown sees no markup."""
    line = " ".join(text.split())
    cut = line if len(line) <= longest else line[: longest - 3] + "..."
    escaped = re.sub(r"([\\`*_\[\]|~])", r"\\\1", cut)
    return escaped.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
