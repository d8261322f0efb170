"""Frames that a night shows: what the baseline and the candidate found in one picture, and pictures that changed."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from datasets.store.dataset import Dataset
from pipelines.detection import Detector
from pipelines.nightly.gates.regenerate import Again
from pipelines.pages.frames import crops, marks_by_frame
from pipelines.pages.numbers import sensible
from pipelines.pages.pictures import Picture, Side


@dataclass(frozen=True, slots=True)
class Wanted:
    """A frame of both datasets, and what the page says of it."""

    place: str  # suite and slice
    frame_id: int
    reason: str
    command: str  # that makes the frame again and shows it


def frame_command(suite: str, frame_id: int, run_id: str, root: Path) -> str:
    """What to type to make a frame of a run in a history's folder again. suite: with its regime."""
    kept = f"--run {run_id} --history {shlex.quote(str(root))}"
    return f"python -m pipelines nightly frame {suite} {frame_id} {kept} --out frame.png"


def pictures_of(
    old: Dataset, new: Dataset, wanted: Sequence[Wanted], detector: str = Detector.EDGE_FIT
) -> list[Picture]:
    """The pictures of some frames with what a detector found on either side, in the order that is given.

    old, new: read the same pictures; `new` holds them.

    Raises:
        UserError: a shard is damaged.
        KeyError: a dataset lacks a frame.
    """
    ids = {item.frame_id for item in wanted}
    before, after = (marks_by_frame(side, detector, ids) for side in (old, new))
    shown = crops(new, ids)
    found: list[Picture] = []
    for item in wanted:
        crop = shown[item.frame_id]
        sides = (
            Side("baseline", before[item.frame_id], crop.image),
            Side("candidate", after[item.frame_id]),
        )
        found.append(Picture(item.frame_id, item.place, item.reason, item.command, crop.corner, sides))
    return found


def rendered_otherwise(again: Sequence[Again], run_id: str, root: Path) -> list[Picture]:
    """Frames that come out otherwise when they are rendered again, the most different first."""
    other = [item for item in again if item.differs]
    other.sort(key=lambda item: (-item.grey_levels, -item.points_px, item.suite, item.frame_id))
    return [_otherwise(item, run_id, root) for item in other]


def _otherwise(item: Again, run_id: str, root: Path) -> Picture:
    stored, rendered = (image[item.region.pixels] for image in (item.stored, item.rendered))
    difference = np.abs(stored.astype(np.int64) - rendered)
    levels = max(item.grey_levels, 1)
    share = 100.0 * float(np.mean(difference > 0))
    told = (
        f"differs by {item.grey_levels} grey level{'s' if item.grey_levels != 1 else ''} at most, in "
        f"{sensible(share)} % of the pixels; true points "
        + ("are the same" if item.points_px == 0.0 else f"by {sensible(item.points_px)} px")
    )
    sides = (
        Side("stored", image=stored),
        Side("rendered tonight", image=rendered),
        Side("difference", image=(difference * (255 // levels)).astype(np.uint8), told=f"white: {levels} or more"),
    )
    corner = item.region.x, item.region.y
    return Picture(
        item.frame_id, item.suite, told, frame_command(item.suite, item.frame_id, run_id, root), corner, sides
    )
