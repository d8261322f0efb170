"""Gate `regenerate`: some pinned frames, rendered again, are what they were.

On the same type of processor and the same versions they are the same bits; elsewhere grey values may differ by one and
true points by rounding. More means that tonight's fresh pictures would not be the kind that the baseline's numbers are
about.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.plan import plan
from datasets.rows import decode_image, points_by_frame
from datasets.store.dataset import Dataset
from pipelines.nightly.record import Exit, Outcome, State
from pipelines.pages.frames import REGION
from pipelines.stages.generate import picture, true_points
from render.targets.image_region import Region

GATE = "regenerate"
FRAMES = 10
GREY_LEVELS = 1  # a value near the middle between two levels falls to either side
POINTS_PX = 1e-9


@dataclass(frozen=True, slots=True)
class Again:
    """One frame rendered again, beside the stored one."""

    suite: str
    frame_id: int
    stored: NDArray[np.uint8]  # (height, width)
    rendered: NDArray[np.uint8]  # likewise
    region: Region  # where the target is
    points_px: float  # largest difference of a true point

    @property
    def grey_levels(self) -> int:
        """Largest difference of a pixel."""
        return int(np.abs(self.stored.astype(np.int64) - self.rendered).max())

    @property
    def differs(self) -> bool:
        """Whether anything came out otherwise."""
        return self.grey_levels > 0 or not self.points_px <= 0.0


def render_again(suite: str, dataset: Dataset, count: int = FRAMES) -> list[Again]:
    """Render evenly chosen frames of a dataset again, without writing anything.

    Raises:
        UserError: a shard is missing or damaged.
    """
    frames = plan(dataset.recipe)
    chosen = {frames[int(i)].frame_id for i in np.linspace(0, len(frames) - 1, min(count, len(frames))).round()}
    found: list[Again] = []
    for path in dataset.shards("frames"):
        ids = set(dataset.read_shard(path, ["frame_id"])["frame_id"].to_pylist()) & chosen
        if not ids:
            continue
        truth = points_by_frame(dataset.read_shard(dataset.sibling(path, "keypoints")), dataset.recipe.target)
        for row in dataset.read_shard(path, ["frame_id", "image", *REGION]).to_pylist():
            if row["frame_id"] in ids:
                frame = frames[row["frame_id"]]
                stored = decode_image(row["image"], path, frame.frame_id)
                region = Region(*(row[name] for name in REGION))
                moved = np.abs(truth[frame.frame_id] - true_points(dataset.recipe, frame))
                rendered = picture(dataset.recipe, frame)
                found.append(Again(suite, frame.frame_id, stored, rendered, region, float(np.nanmax(moved))))
    return found


def judge(again: list[Again], reasons: Sequence[str]) -> Outcome:
    """reasons: versions, processor and kernel that are not those that the pinned pictures were made with."""
    grey, points = (GREY_LEVELS, POINTS_PX) if reasons else (0, 0.0)
    other = [item for item in again if item.grey_levels > grey or not item.points_px <= points]
    because = f"; {'; '.join(reasons)}" if reasons else ""
    if other:
        worst = max(other, key=lambda item: (item.grey_levels, item.points_px))
        told = (
            f"{len(other)} of {len(again)} pinned frames come out otherwise, frame {worst.frame_id} of {worst.suite} "
            f"by {worst.grey_levels} grey levels and {worst.points_px:.2g} px{because}"
        )
        frames = tuple((item.suite, item.frame_id) for item in other)
        return Outcome(GATE, State.FAILED, told, Exit.NO_VERDICT, frames=frames)
    if any(item.differs for item in again):
        return Outcome(GATE, State.CHANGED, f"{len(again)} pinned frames come out within one grey level{because}")
    state = State.CHANGED if reasons else State.PASSED
    return Outcome(GATE, state, f"{len(again)} pinned frames, rendered again, are the same bits{because}")
