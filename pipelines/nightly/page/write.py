"""Writing the page of a night from the history."""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from datasets.store.atomic import write_text
from pipelines.nightly.comparison import Verdict
from pipelines.nightly.gates import accuracy, fresh
from pipelines.nightly.history import LATEST, History
from pipelines.nightly.page import plots
from pipelines.nightly.page.findings import CHANGED, ORDER, Row, by_slice, most_changed, tonight
from pipelines.nightly.page.series import Nights, headlines
from pipelines.nightly.record import Exit
from pipelines.nightly.suites import CONFIRMING, FRESH, PINNED
from pipelines.pages.pictures import Picture, drawn
from pipelines.pages.template import rendered

TEMPLATE = Path(__file__).with_name("page.html")
MOST_NIGHTS = 365
MOST_PICTURES = 12
LEAST_ROOM = 60  # nights that the strip has room for, so that a few do not become wide bars
MOST_TOLD = 5  # nights that were not fine, in words
COMMAND = "python -m pipelines nightly"
GATES = {PINNED: accuracy.GATE, FRESH: fresh.GATE}  # suite to the gate that its changes fail
EVERY_NIGHT = (FRESH, CONFIRMING)  # data that are others every night, so that their hashes tell nothing
WORDS = {
    Exit.FINE: "fine",
    Exit.WORSE: "worse",
    Exit.NO_VERDICT: "no verdict",
    Exit.COULD_NOT_RUN: "could not run",
}
TONES = {Exit.FINE: "good", Exit.NO_VERDICT: "warn"}


@dataclass(frozen=True, slots=True)
class Shown:
    """Pictures of a night, the worst first; a dozen of each kind are shown."""

    worst: Sequence[Picture] = ()  # what both sides found in one picture
    otherwise: Sequence[Picture] = ()  # pictures that come out otherwise than they are stored


def write_page(history: History, run_id: str | None, out: Path, shown: Shown | None = None) -> None:
    """Write the page of a run, of the newest if `run_id` is None.

    The nights up to this run are shown with it, a year at most.

    Raises:
        UserError: no such run, a damaged file of the history, or the disk refuses.
    """
    chosen = history.name_of(run_id or LATEST)
    ids = history.run_ids()
    end = ids.index(chosen) + 1
    pictures = shown or Shown()
    named = ids[max(0, end - MOST_NIGHTS) : end]
    runs = history.runs().to_pylist()[end - len(named) : end]
    rows = tonight(history.findings([chosen]))
    nights = Nights(history.findings(named), named)
    html = rendered(
        TEMPLATE,
        **_of_night(runs),
        **_of_findings(rows, nights, runs),
        **_commands(rows, chosen, history.root),
        worst=[drawn(picture) for picture in pictures.worst[:MOST_PICTURES]],
        otherwise=[drawn(picture) for picture in pictures.otherwise[:MOST_PICTURES]],
    )
    write_text(out, html)


def _of_night(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """The verdict, the gates, the machine, and how the nights before ended."""
    run, before = runs[-1], runs[-2] if len(runs) > 1 else None
    ended = Counter(_word(item["exit"]) for item in runs)
    others = [item for item in runs[:-1] if item["exit"] != Exit.FINE]
    return {
        "run": run,
        "word": _word(run["exit"]),
        "tone": TONES.get(run["exit"], "bad"),
        "runs": runs,
        "room": max(LEAST_ROOM, len(runs)),
        "words": [_word(item["exit"]) for item in runs],
        "ended": ", ".join(f"{count} {word}" for word, count in ended.most_common()),
        "told": [(item, _word(item["exit"])) for item in reversed(others[-MOST_TOLD:])],
        "facts": _against(run["facts"], before["facts"] if before else run["facts"]),
        "data": _against(
            [item for item in run["data"] if not item["name"].startswith(EVERY_NIGHT)],
            before["data"] if before else run["data"],
        ),
    }


def _of_findings(rows: list[Row], nights: Nights, runs: list[dict[str, Any]]) -> dict[str, Any]:
    """The changes, the ways of the headline metrics, and the table of slices."""
    changes = most_changed(rows)
    named = [i for i, run in enumerate(runs) if run["baseline"]]  # a night without a baseline has no verdict
    moved = [i for before, i in pairwise(named) if runs[i]["baseline"] != runs[before]["baseline"]]
    counts = Counter(row.verdict for row in rows)
    return {
        "changes": [(row, plots.interval(row)) for row in changes],
        "more": sum(counts[name] for name in CHANGED) - len(changes),
        "counts": [(name, counts[name]) for name in ORDER if counts[name]],
        "compared": len(rows),
        "moved": [(runs[i]["started"], runs[i]["baseline"]) for i in moved],
        "trends": [_trend(row, nights, moved) for row in headlines(rows, changes)],
        "kinds": [(name, name) for name in ORDER if counts[name]],
        "changed": CHANGED,
        "places": {name: f"slice-{i}" for i, name in enumerate(by_slice(rows), start=1)},
        "slices": [(name, own, plots.spark(nights.of(own[0].key))) for name, own in by_slice(rows).items()],
    }


def _commands(rows: list[Row], run_id: str, root: Path) -> dict[str, Any]:
    """What to type next: to look closer, to accept the run, to waive one failure."""
    of_run, kept = shlex.quote(run_id), f"--history {shlex.quote(str(root))}"
    accept = f"{COMMAND} accept {of_run} {kept} --reason 'why this is right'"
    return {
        "explain": {
            name: f"{COMMAND} explain {shlex.quote(name)} {kept} --run {of_run}"
            for name in dict.fromkeys(row.key.slice for row in rows)
        },
        "accept": accept,
        "waive": [
            f"{accept} --gate {GATES[row.key.suite]} --slice {shlex.quote(row.key.slice)} "
            f"--metric {shlex.quote(row.key.metric)} --until DATE"
            for row in most_changed(rows)
            if row.verdict == Verdict.WORSE and row.key.suite in GATES
        ],
    }


def _trend(row: Row, nights: Nights, moved: list[int]) -> dict[str, Any]:
    series = nights.of(row.key)
    found = plots.trend(series, moved)
    return {
        "row": row,
        "inside": found.inside,
        "worse": int(series.worse.sum()),
        "axis": row.values(found.highest, found.lowest),
    }


def _word(code: int) -> str:
    return WORDS.get(Exit(code), "") if code in set(Exit) else f"exit {code}"


def _against(now: list[dict[str, str]], before: list[dict[str, str]]) -> list[tuple[str, str, str | None]]:
    """(name, value, the value of the night before where it was another)."""
    old = {item["name"]: item["value"] for item in before}
    found: list[tuple[str, str, str | None]] = []
    for item in now:
        name, value = item["name"], item["value"]
        found.append((name, value, None if old.get(name) == value else old.get(name, "none")))
    return found
