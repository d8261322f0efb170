"""The frames that the report shows: a usual one of each camera, large, and the worst ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from datasets.store.dataset import Dataset
from pipelines.pages.frames import crops, marks_by_frame
from pipelines.pages.numbers import sensible
from pipelines.pages.pictures import LARGE_PX, SMALL_PX, Drawn, Picture, Side, drawn
from pipelines.report.data import EXACT, Series
from pipelines.report.frame_points import FramePoints

MOST_CAMERAS, MOST_WORST = 8, 6


@dataclass(frozen=True, slots=True)
class Chosen:
    """A frame that is shown, and why."""

    row: int  # in the table of frames
    reason: str = ""


def usual(frames: list[dict[str, Any]], item: FramePoints | None) -> list[Chosen]:
    """Of each camera the frame whose corner error is the median of its frames', or its middle frame without points."""
    cameras = np.array([frame["camera_name"] for frame in frames])
    error = np.zeros(len(frames)) if item is None else np.sqrt(item.square)
    found: list[Chosen] = []
    for camera in list(dict.fromkeys(cameras.tolist()))[:MOST_CAMERAS]:
        own = np.flatnonzero((cameras == camera) & np.isfinite(error))
        own = own if len(own) else np.flatnonzero(cameras == camera)
        order = own[np.argsort(error[own], kind="stable")]
        found.append(Chosen(int(order[(len(order) - 1) // 2])))
    return found


def worst(frames: list[dict[str, Any]], item: FramePoints | None, found: Sequence[Series]) -> list[Chosen]:
    """Frames without a board or a pose, then those whose corners are off most, over what the detection states."""
    failed = _failures(frames, found)
    lost = np.zeros(len(frames), bool) if item is None else ~item.boards
    badness = 1e6 * lost + 1e3 * np.array([len(names) for names in failed])
    if item is not None:
        size = item.normalised if np.any(np.isfinite(item.normalised)) else item.square
        badness += np.nan_to_num(np.sqrt(size))
    order = np.argsort(-badness, kind="stable")[:MOST_WORST]
    return [
        Chosen(int(row), _reason(row, bool(lost[row]), failed[row], item))
        for row in order.tolist()
        if badness[row] > 0.0
    ]


def drawings(
    dataset: Dataset, frames: list[dict[str, Any]], chosen: Sequence[Chosen], item: FramePoints | None, large: bool
) -> list[Drawn]:
    """The frames with what was found in them, and the command that makes each again.

    Raises:
        UserError: a shard is damaged.
    """
    shown = crops(dataset, {frames[one.row]["frame_id"] for one in chosen})
    marks = {} if item is None else marks_by_frame(dataset, item.detector, set(shown))
    found: list[Drawn] = []
    for one in chosen:
        frame = frames[one.row]
        number, crop = frame["frame_id"], shown[frame["frame_id"]]
        command = f"python -m pipelines frame DATASET {number} --out frame-{number}.png"
        place = f"{frame['camera_name']}, tilt {frame['tilt_deg']:.0f}°"
        sides = (Side(marks=marks.get(number), image=crop.image),)
        picture = Picture(number, place, one.reason, command, crop.corner, sides)
        found.append(drawn(picture, LARGE_PX if large else SMALL_PX))
    return found


def _failures(frames: list[dict[str, Any]], found: Sequence[Series]) -> list[list[str]]:
    """Of each frame the settings, with the true camera, that have no pose for it."""
    place = {frame["frame_id"]: row for row, frame in enumerate(frames)}
    names: list[list[str]] = [[] for _ in frames]
    for item in found:
        if item.key["assumed_camera"] == EXACT:
            for frame_id in np.unique(item.frame_id[item.failed]).tolist():
                names[place[frame_id]].append(item.name)
    return names


def _reason(row: int, lost: bool, failed: list[str], item: FramePoints | None) -> str:
    if lost:
        return "no board was found"
    if failed:
        return f"no pose by {', '.join(failed)}"
    if item is None:
        return ""
    stated = float(np.sqrt(item.normalised[row]))
    told = f"corner {item.largest_corner[row]} is off by {sensible(float(item.largest[row]))} px"
    return told + (f"; all corners by {stated:.2f} times what is stated" if np.isfinite(stated) else "")
