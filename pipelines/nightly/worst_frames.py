"""The frames of a night that are worth a look: those that fail anew, then those whose worse numbers moved most."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pyarrow as pa

from datasets.store.dataset import Dataset, open_dataset
from pipelines.nightly.comparison import Verdict
from pipelines.nightly.explanation import steps
from pipelines.nightly.judgement import Finding
from pipelines.nightly.measures import Slice, slices
from pipelines.nightly.metrics import METRICS
from pipelines.nightly.other_code import Code
from pipelines.nightly.page.frames import Wanted, frame_command, pictures_of
from pipelines.nightly.suites import FRESH, PINNED, copy_pictures
from pipelines.pages.pictures import Picture

MOST_FRAMES = 12


@dataclass(frozen=True, slots=True)
class Noticed:
    """A frame, and what is to be seen in it."""

    kind: str  # of the suite
    regime: str
    slice: str
    frame_id: int
    reason: str
    margins: float  # how many margins the number moved, infinite for a failure

    @property
    def suite(self) -> str:
        """The suite's name."""
        return f"{self.kind}-{self.regime}"

    def wanted(self, run_id: str, root: Path) -> Wanted:
        """For the page of a run in a history's folder."""
        command = frame_command(self.suite, self.frame_id, run_id, root)
        return Wanted(f"{self.kind}, {self.slice}", self.frame_id, self.reason, command)


def worst(measures: Mapping[str, pa.Table], findings: Mapping[str, Sequence[Finding]]) -> list[Noticed]:
    """The worst frames of both suites, each once, a dozen at most.

    measures: by suite and side. findings: by suite; frames are ranked by the metrics that are worse in their slice, and
    where no metric is worse anywhere, as when frames fail only, by all of them.
    """
    noticed = [
        item
        for kind in (PINNED, FRESH)
        if f"{kind} old" in measures and f"{kind} new" in measures
        for item in _of_suite(kind, measures[f"{kind} old"], measures[f"{kind} new"], findings.get(kind, ()))
    ]
    first: dict[tuple[str, int], Noticed] = {}
    for item in sorted(noticed, key=lambda item: -item.margins):
        first.setdefault((item.suite, item.frame_id), item)
    return list(first.values())[:MOST_FRAMES]


def pictures_of_all(
    noticed: Sequence[Noticed], run_id: str, root: Path, work: Path, code: Code, workers: int
) -> list[Picture]:
    """The pictures of frames, in their order, while the night's work folder is there. code: the baseline's.

    Raises:
        OtherCodeError: the baseline's code failed on the pinned pictures, which it has to read for this.
        UserError: a shard is damaged, or the disk refuses.
    """
    shown: dict[Noticed, Picture] = {}
    for suite in dict.fromkeys(item.suite for item in noticed):
        own = [item for item in noticed if item.suite == suite]
        old, new = _both_sides(suite, own[0].kind, work, code, workers)
        wanted = [item.wanted(run_id, root) for item in own]
        shown |= dict(zip(own, pictures_of(old, new, wanted), strict=True))
    return [shown[item] for item in noticed]


def _both_sides(suite: str, kind: str, work: Path, code: Code, workers: int) -> tuple[Dataset, Dataset]:
    """What the baseline's code and the candidate detected; of the pinned pictures the baseline has only numbers."""
    if kind == FRESH:
        return open_dataset(work / f"{suite}-old"), open_dataset(work / f"{suite}-new")
    new, folder = open_dataset(work / suite), work / f"{suite}-old"
    copy_pictures(new, folder)
    code.run("detect", folder, "--workers", str(workers), "--quiet")
    return open_dataset(folder), new


def _of_suite(kind: str, old: pa.Table, new: pa.Table, findings: Sequence[Finding]) -> Iterator[Noticed]:
    worse = [(item.slice, item.change.metric.name) for item in findings if item.verdict is Verdict.WORSE]
    before = {item.name: item for item in slices(old)}
    for after in slices(new):
        if after.name in before:
            names = [name for name in METRICS if (after.name, name) in worse or not worse]
            yield from _of_slice(kind, before[after.name], after, names)


def _of_slice(kind: str, before: Slice, after: Slice, metrics: Sequence[str]) -> Iterator[Noticed]:
    place = (kind, after.regime, after.name)
    frames, of_old, of_new = np.intersect1d(before.frame_id, after.frame_id, return_indices=True)
    for frame in frames[after.failed[of_new] & ~before.failed[of_old]]:
        yield Noticed(*place, int(frame), "fails, and did not before", np.inf)
    for item in steps(kind, before, after, {name: METRICS[name].margin for name in metrics}):
        unit = METRICS[item.metric].unit
        told = f"{item.metric} {item.old:.3g} to {item.new:.3g}{'' if unit == '1' else ' ' + unit}"
        yield Noticed(*place, item.frame_id, told, item.margins)
