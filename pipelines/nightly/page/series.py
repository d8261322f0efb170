"""Every metric of every slice over the nights, as arrays that figures are drawn from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.nightly.page.findings import Key, Row
from pipelines.nightly.suites import PINNED

# What a team looks at first, each shown for the slice that is nearest to its margin, which stands for the others.
HEADLINES = ("corner_log_ms", "corner_nees", "corner_radial", "pose_log_t", "pose_log_R", "pose_nees")
MOST_TRENDS = 6


@dataclass(frozen=True, slots=True)
class Series:
    """One metric in one slice over n nights; (n,) NaN on nights that did not compare it."""

    old: Array
    new: Array
    low: Array  # interval of new minus old
    high: Array
    margin: Array
    worse: Mask


class Nights:
    """The findings of some nights, looked up by what is followed."""

    def __init__(self, findings: pa.Table, run_ids: Sequence[str]) -> None:
        """findings: rows of these runs, as in `history.FINDINGS`."""
        runs, names = _encoded(findings["run_id"])
        place = {run_id: night for night, run_id in enumerate(run_ids)}
        night = np.array([place[name] for name in names], np.int64)[runs]
        texts = [_encoded(findings[name]) for name in Key._fields]
        code = np.zeros(findings.num_rows, np.int64)
        for indices, names in texts:
            code = code * len(names) + indices
        codes, row = np.unique(code, return_inverse=True)
        self._place: dict[Key, int] = {}
        for place, value in enumerate(codes.tolist()):
            parts: list[str] = []
            for _, names in reversed(texts):
                value, index = divmod(value, len(names))
                parts.append(names[index])
            self._place[Key(*reversed(parts))] = place
        shape = len(codes), len(run_ids)
        self._numbers = {name: np.full(shape, np.nan) for name in ("old", "new", "low", "high", "margin")}
        for name, dense in self._numbers.items():
            dense[row, night] = findings[name].to_numpy()
        self._worse = np.zeros(shape, np.bool_)
        verdicts, names = _encoded(findings["verdict"])
        self._worse[row, night] = np.array([name == "worse" for name in names], np.bool_)[verdicts]

    def of(self, key: Key) -> Series:
        """What the nights found of one metric in one slice, which one of them must have compared."""
        place = self._place[key]
        return Series(**{name: dense[place] for name, dense in self._numbers.items()}, worse=self._worse[place])


def headlines(rows: list[Row], changes: list[Row]) -> list[Row]:
    """Tonight's rows whose way over the nights is shown: changes, then `HEADLINES`."""
    chosen = {row.key: row for row in changes[: MOST_TRENDS // 2]}
    for metric in HEADLINES:
        own = [row for row in rows if row.key.metric == metric]
        pinned = [row for row in own if row.key.suite == PINNED] or own
        if pinned and not any(key.metric == metric for key in chosen):
            nearest = max(pinned, key=lambda row: row.size)
            chosen[nearest.key] = nearest
    return list(chosen.values())[:MOST_TRENDS]


def _encoded(column: pa.ChunkedArray) -> tuple[NDArray[np.int64], list[str]]:
    """(r,) index of each text, and the texts."""
    encoded = column.combine_chunks().dictionary_encode()
    return encoded.indices.to_numpy().astype(np.int64), encoded.dictionary.to_pylist()
