"""One slice of one run in full: every metric, how it went in the nights before, and the frames that moved most."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from datasets.errors import UserError, did_you_mean
from pipelines.nightly.history import History
from pipelines.nightly.measures import Slice, slices

MOST_FRAMES = 10


@dataclass(frozen=True, slots=True)
class Moved:
    """A frame whose number is another than the baseline's."""

    suite: str
    frame_id: int
    metric: str
    old: float
    new: float
    margins: float  # how many margins it moved


@dataclass(frozen=True, slots=True)
class Explanation:
    """What is known of a slice."""

    run_id: str
    findings: tuple[dict[str, Any], ...]  # rows of `history.FINDINGS`
    trend: tuple[dict[str, Any], ...]  # run_id, suite, metric, effect and verdict in the nights before
    moved: tuple[Moved, ...]  # the furthest first

    def rows(self) -> list[tuple[str, ...]]:
        """Cells: suite, metric, change, interval, margin, verdict."""
        return [
            (
                item["suite"], item["metric"], f"{item['effect']:+.2g}", f"{item['low']:+.2g} to {item['high']:+.2g}",
                f"{item['margin']:.2g}", item["verdict"],
            )
            for item in self.findings
        ]  # fmt: skip

    def lines(self) -> Iterator[str]:
        """The trend of what changed, and the frames."""
        changed = dict.fromkeys((item["suite"], item["metric"]) for item in self.findings if item["verdict"] == "worse")
        for suite, metric in changed:
            found = [item for item in self.trend if (item["suite"], item["metric"]) == (suite, metric)]
            yield f"{suite} {metric} before: " + (", ".join(f"{item['effect']:+.2g}" for item in found) or "no night")
        for item in self.moved:
            yield f"frame {item.frame_id} of {item.suite}: {item.metric} {item.old:.3g} to {item.new:.3g}"

    def as_json(self) -> dict[str, Any]:
        """The same for machines."""
        return {
            "run": self.run_id, "findings": list(self.findings), "before": list(self.trend),
            "moved": [asdict(item) for item in self.moved],
        }  # fmt: skip


def explain(root: Path, run: str, slice: str, nights: int) -> Explanation:
    """Collect what the history has of a slice. nights: how many before the run are shown.

    Raises:
        UserError: no such run, or no such slice in it, with the known ones.
    """
    history = History(root)
    run_id = history.name_of(run)
    found = history.findings([run_id]).to_pylist()
    known = list(dict.fromkeys(item["slice"] for item in found))
    if slice not in known:
        told = ", ".join(known) or "none: nothing was compared"
        raise UserError(f"run {run_id} has no slice {slice!r}{did_you_mean(slice, known)}; it has {told}")
    ids = history.run_ids()
    before = ids[max(0, ids.index(run_id) - nights) : ids.index(run_id)]
    trend = [item for item in history.findings(before).to_pylist() if item["slice"] == slice]
    own = tuple(item for item in found if item["slice"] == slice)
    return Explanation(run_id, own, tuple(trend), tuple(_moved(history, run_id, slice, own)))


def _moved(history: History, run_id: str, slice: str, findings: tuple[dict[str, Any], ...]) -> list[Moved]:
    run = history.run(run_id)
    digests = {item["name"]: item["value"] for item in run["measures"]}
    moved: list[Moved] = []
    for suite in dict.fromkeys(item["suite"] for item in findings):
        if f"{suite} old" not in digests:
            continue
        tables = (history.measures(digests[f"{suite} {side}"]) for side in ("old", "new"))
        before, after = (next((item for item in slices(table) if item.name == slice), None) for table in tables)
        if before is not None and after is not None:
            margins = {item["metric"]: item["margin"] for item in findings if item["suite"] == suite}
            moved += _steps(suite, before, after, margins)
    return sorted(moved, key=lambda item: -item.margins)[:MOST_FRAMES]


def _steps(suite: str, before: Slice, after: Slice, margins: dict[str, float]) -> Iterator[Moved]:
    """Every metric of every frame that both sides have and that differs."""
    frames, of_old, of_new = np.intersect1d(before.frame_id, after.frame_id, return_indices=True)
    for name, margin in margins.items():
        if name in before.values and name in after.values:
            old, new = before.values[name][of_old], after.values[name][of_new]
            for i in np.flatnonzero(np.isfinite(old) & np.isfinite(new) & (old != new)):
                step = abs(float(new[i] - old[i])) / margin
                yield Moved(suite, int(frames[i]), name, float(old[i]), float(new[i]), step)
