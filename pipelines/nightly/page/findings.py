"""Tonight's comparisons as the page shows them: what changed comes first, and logs are shown as per cent."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa

from pipelines.nightly.comparison import holm
from pipelines.nightly.gates import fresh
from pipelines.nightly.metrics import METRICS
from pipelines.nightly.suites import CONFIRMING, FRESH
from pipelines.pages.numbers import rounded, sensible, with_interval
from pipelines.statistics import Interval

# A change on fresh views that a second look on others did not confirm, as happens by chance on a few nights.
UNCONFIRMED = "unconfirmed"
ORDER = ("worse", "better", UNCONFIRMED, "unproved", "equal")  # of the page
CHANGED = ORDER[:2]
MOST_CHANGES = 5


class Key(NamedTuple):
    """What is followed over the nights."""

    suite: str
    slice: str
    metric: str


@dataclass(frozen=True, slots=True)
class Row:
    """One metric in one slice of one suite; the numbers as in `history.FINDINGS`."""

    key: Key
    unit: str
    poses: int
    old: float
    new: float
    effect: float
    low: float
    high: float
    margin: float
    smallest_visible: float
    p: float
    verdict: str  # one of ORDER
    again: Row | None = None  # the second look that confirmed a change on fresh views

    @property
    def size(self) -> float:
        """The effect in margins, which compares metrics of different units."""
        return abs(self.effect) / self.margin if self.margin > 0.0 else np.inf

    @property
    def toward_worse(self) -> bool:
        """Whether the change is one for the worse: a larger error, or a value further from what it should be."""
        return self.effect > 0.0 if self.unit.startswith("log") else abs(self.new) > abs(self.old)

    @property
    def meaning(self) -> str:
        """The metric in words; empty for one that this version does not know."""
        return METRICS[self.key.metric].meaning if self.key.metric in METRICS else ""

    @property
    def in_logs(self) -> bool:
        """Whether the numbers are logs, whose changes read as per cent."""
        return self.unit == "1" or self.unit.startswith("log")

    @property
    def shown_unit(self) -> str:
        """Unit of the texts of changes."""
        return "%" if self.in_logs else self.unit

    @property
    def change(self) -> str:
        """The effect with its 95 % interval, to the digits that the interval supports, two of the effect at most."""
        return with_interval(Interval(*(self._shown(value) for value in (self.effect, self.low, self.high))), True)

    @property
    def margin_text(self) -> str:
        """The margin."""
        return f"\N{PLUS-MINUS SIGN}{sensible(self._shown(self.margin))}"

    @property
    def visible_text(self) -> str:
        """The smallest change that such a night sees."""
        return f"\N{PLUS-MINUS SIGN}{sensible(self._shown(self.smallest_visible))}"

    @property
    def value_unit(self) -> str:
        """Unit of the texts of values: those of logs are shown as what they are logs of."""
        unit = self.unit.removeprefix("log").strip() if self.in_logs else self.unit
        return "" if unit == "1" else unit.replace("^2", "\N{SUPERSCRIPT TWO}")

    def values(self, one: float, other: float) -> tuple[str, str]:
        """Two values of the metric as texts, to the digits in which they differ."""
        one, other = (float(np.exp(value)) if self.in_logs else value for value in (one, other))
        step = (abs(other - one) or abs(one)) / 5.0
        if max(abs(one), abs(other)) < 1e-4 and step > 0.0:
            digits = int(np.clip(np.floor(np.log10(abs(one) + abs(other))) - np.floor(np.log10(step)), 0, 9))
            return f"{one:.{digits}e}", f"{other:.{digits}e}"
        return rounded(one, step), rounded(other, step)

    def _shown(self, value: float) -> float:
        return 100.0 * float(np.expm1(value)) if self.in_logs else value


def tonight(findings: pa.Table) -> list[Row]:
    """Rows of one run's findings, the changed ones first; a second look is told with what it confirms."""
    rows = [_row(item) for item in findings.to_pylist()]
    believed = _confirmed(
        [row for row in rows if row.key.suite == FRESH and row.verdict == "worse"],
        {row.key[1:]: row for row in rows if row.key.suite == CONFIRMING},
    )
    shown = [_judged(row, believed.get(row.key)) for row in rows if row.key.suite != CONFIRMING]
    return sorted(shown, key=lambda row: (ORDER.index(row.verdict), -row.size))


def most_changed(rows: list[Row]) -> list[Row]:
    """The changes to tell first, each metric of a slice once although two suites may show it."""
    first = {row.key[1:]: row for row in reversed(rows) if row.verdict in CHANGED}
    return [row for row in rows if first.get(row.key[1:]) is row][:MOST_CHANGES]


def by_slice(rows: list[Row]) -> dict[str, list[Row]]:
    """Slice to its rows; the order of both is kept."""
    found: defaultdict[str, list[Row]] = defaultdict(list)
    for row in rows:
        found[row.key.slice].append(row)
    return dict(found)


def _row(item: dict[str, Any]) -> Row:
    key = Key(item["suite"], item["slice"], item["metric"])
    verdict = item["verdict"] if item["verdict"] in ORDER else "unproved"
    numbers = {name: item[name] for name in Row.__slots__ if name not in ("key", "verdict", "again")}
    return Row(key, **numbers, verdict=verdict)


def _confirmed(flagged: list[Row], second: dict[tuple[str, ...], Row]) -> dict[Key, Row]:
    """Flagged changes and the second looks that confirm them, found as gate `fresh` does from the same numbers."""
    looked_at = [(row, second[row.key[1:]]) for row in flagged if row.key[1:] in second]
    if not looked_at:
        return {}
    rejected = holm(np.array([again.p for _, again in looked_at]), fresh.ALPHA)
    return {
        row.key: again
        for (row, again), differs in zip(looked_at, rejected, strict=True)
        if differs and again.size > 1.0 and again.toward_worse
    }


def _judged(row: Row, again: Row | None) -> Row:
    if row.key.suite != FRESH or row.verdict not in CHANGED:
        return row
    return replace(row, again=again) if again else replace(row, verdict=UNCONFIRMED)
