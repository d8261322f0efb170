"""A night with everything that was compared: what all outputs are written from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa

from pipelines.nightly.comparison import Verdict
from pipelines.nightly.gates import fresh
from pipelines.nightly.judgement import Finding
from pipelines.nightly.measures import KEY, slices
from pipelines.nightly.record import Night, State
from pipelines.nightly.suites import FRESH, PINNED

SIDES = BASELINE, CANDIDATE = "old", "new"  # of a table of measures


@dataclass(frozen=True, slots=True)
class SliceCount:
    """How many frames one side has in a slice, and how many of them failed."""

    suite: str
    side: str  # old or new
    slice: str
    frames: int
    failed: int


@dataclass(frozen=True, slots=True)
class Results:
    """One night as `History.append` takes it."""

    night: Night
    findings: Mapping[str, Sequence[Finding]]  # by suite
    alpha: float  # level of each suite's family of comparisons
    measures: Mapping[str, pa.Table]  # by suite and side, as "pinned new"

    def changes(self) -> list[tuple[str, Finding]]:
        """Suite and finding of what got worse, then of what got better, each the largest beside its margin first.

        Of views that nobody has seen before, only what a second look has confirmed: one look in twenty finds something
        by chance.
        """
        seen = [(suite, item) for suite in (PINNED, FRESH) for item in self.findings.get(suite, ())]
        confirmed = self._confirmed()
        changed = [
            (suite, item)
            for suite, item in seen
            if item.verdict in (Verdict.WORSE, Verdict.BETTER) and (suite == PINNED or _key(item) in confirmed)
        ]
        return sorted(changed, key=lambda entry: (entry[1].verdict is Verdict.BETTER, -_size(entry[1])))

    def smallest_visible(self, suite: str, finding: Finding) -> float:
        """The change of a finding's metric that 95 of 100 such nights would have seen."""
        return finding.change.smallest_visible(self.alpha, len(self.findings[suite]))

    def counts(self) -> list[SliceCount]:
        """Frames and failed frames of each slice."""
        return [
            SliceCount(suite, side, item.name, len(item.failed), int(np.sum(item.failed)))
            for (suite, side), table in ((name.split(" ", 1), table) for name, table in self.measures.items())
            for item in slices(table)
        ]

    def lenses(self) -> list[str]:
        """Every sensor regime with camera, of all suites."""
        held = [
            zip(table["regime"].to_pylist(), table["camera_name"].to_pylist(), strict=True) for table in self._new()
        ]
        from_measures = {"/".join(key) for keys in held for key in keys}
        from_findings = {lens_of(item.slice) for items in self.findings.values() for item in items}
        return sorted(from_measures | from_findings)

    def lenses_of_frame(self, suite: str, frame: int) -> set[str]:
        """Sensor regimes with cameras in which a frame of that number fails anew; if in none, those that have one.

        Frames of two regimes have the same numbers, so the number alone does not tell the regime.
        """
        before, after = (self._failed(f"{suite} {side}", frame) for side in SIDES)
        anew = {key for key, failed in after.items() if failed and not before.get(key, False)}
        return {"/".join(key[:2]) for key in anew or after}

    def _failed(self, name: str, frame: int) -> dict[tuple[str, ...], bool]:
        """Regime, camera and system to whether a frame failed, of those that have it."""
        table = self.measures.get(name)
        if table is None:
            return {}
        rows = table.select([*KEY, "failed"]).filter(pa.array(table["frame_id"].to_numpy() == frame)).to_pylist()
        return {tuple(row[part] for part in KEY): row["failed"] for row in rows}

    def _confirmed(self) -> set[tuple[str, str]]:
        """Slice and metric of what gate `fresh` believes, be it accepted or not."""
        believed = (State.FAILED, State.WAIVED)
        own = [item for item in self.night.outcomes if item.gate == fresh.GATE and item.state in believed]
        return {_key(finding) for outcome in own for finding in outcome.findings}

    def _new(self) -> list[pa.Table]:
        return [table for name, table in self.measures.items() if name.endswith(f" {CANDIDATE}")]


def lens_of(slice: str) -> str:
    """Sensor regime with camera of a slice, without the system."""
    return "/".join(slice.split("/", 2)[:2])


def _key(finding: Finding) -> tuple[str, str]:
    return finding.slice, finding.change.metric.name


def _size(finding: Finding) -> float:
    return abs(finding.change.effect) / finding.change.metric.margin
