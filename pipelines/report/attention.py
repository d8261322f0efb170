"""What in a run deserves attention: what failed, and errors that are not as they should be by more than chance."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from eposit.arrays import Mask
from pipelines.pages.numbers import with_interval
from pipelines.report.data import EXACT, Series
from pipelines.report.frame_points import FramePoints
from pipelines.report.run import Run, by_pose, counted, poses_of
from pipelines.statistics import LEVEL, Interval, root, student

HONEST = 0.8, 1.3  # normalised errors within are as good as stated
MOST_NAMED = 8  # frames or cameras in one sentence


def attention(run: Run) -> Iterator[str]:
    """A sentence without its full stop for each; none if the run is as it should be."""
    for item in run.points:
        yield from _not_found(run, item)
        yield from _made_up(run, item)
    for item in run.found:
        yield from _failures(item)
    for item in run.points:
        yield from _biased(run, item)
        yield from _dishonest_points(run, item)
    yield from _dishonest_poses(run)


def _not_found(run: Run, item: FramePoints) -> Iterator[str]:
    lost = ~item.boards & item.shows
    if np.any(lost):
        yield f"{item.detector} found no board in {counted(int(lost.sum()), 'frame')}: {_named(run, lost)}"
    missing = np.where(lost, 0, item.visible - item.found)
    frames = missing > 0
    if np.any(frames):
        told = f"{item.detector} left out {counted(int(missing.sum()), 'corner')} of boards that it found, in "
        yield told + f"{counted(int(frames.sum()), 'frame')}: {_named(run, frames)}"
    circles = item.circle_visible & ~item.circle & ~lost
    if np.any(circles):
        told = f"{item.detector} found the board and not the circle in {counted(int(circles.sum()), 'frame')}"
        yield f"{told}: {_named(run, circles)}"


def _made_up(run: Run, item: FramePoints) -> Iterator[str]:
    frames = item.made_up > 0
    if np.any(frames):
        told = f"{item.detector} found {counted(int(item.made_up.sum()), 'point')} that cannot be seen, in "
        yield told + f"{counted(int(frames.sum()), 'frame')}: {_named(run, frames)}"


def _failures(item: Series) -> Iterator[str]:
    if np.any(item.failed):
        counts = Counter(item.status[item.failed].tolist())
        why = ", ".join(f"{count} {status}" for status, count in counts.most_common())
        yield f"{item.name} failed in {int(item.failed.sum())} of {len(item.failed)} estimates: {why}"
    wrong = item.gross & ~item.failed
    if np.any(wrong):
        told = f"{item.name} gave {counted(int(wrong.sum()), 'pose')} as ok whose position is wrong by its own length"
        yield f"{told} or more: frames {_listed(sorted(set(item.frame_id[wrong].tolist())))}"
    if np.any(item.ambiguous):
        told = f"{item.name} says of {counted(int(item.ambiguous.sum()), 'pose')} that the points allow another as well"
        yield f"{told}: frames {_listed(sorted(set(item.frame_id[item.ambiguous].tolist())))}"
    if np.any(item.unreliable) and item.key["assumed_camera"] == EXACT:  # points contradict any other camera
        told = f"{item.name} says of {counted(int(item.unreliable.sum()), 'pose')} that its covariance is unreliable"
        yield f"{told}: frames {_listed(sorted(set(item.frame_id[item.unreliable].tolist())))}"


def _biased(run: Run, item: FramePoints) -> Iterator[str]:
    """Means that are not zero, at 5 % over all cameras and directions together (Bonferroni)."""
    cameras = dict.fromkeys(run.cameras.tolist())
    kinds = (("x", item.mean_x), ("y", item.mean_y), ("the radius", item.mean_radial))
    level = _shared(len(cameras) * len(kinds))
    for camera in cameras:
        own = run.cameras == camera
        for name, values in kinds:
            found = student(by_pose(values[own], run.poses(own)), level)
            if found.low > 0.0 or found.high < 0.0:
                told = f"corners of {item.detector} in {camera} are off by {with_interval(found, True)} px on average"
                yield f"{told} along {name}, more than chance explains"


def _dishonest_points(run: Run, item: FramePoints) -> Iterator[str]:
    cameras = dict.fromkeys(run.cameras.tolist())
    level = _shared(2 * len(cameras))
    for camera in cameras:
        own = run.cameras == camera
        for name, values in (("corners", item.normalised), ("circles", item.circle_normalised)):
            over = root(student(by_pose(values[own], run.poses(own)), level))
            if _is_dishonest(over):
                yield (
                    f"{name} of {item.detector} in {camera} are off by {with_interval(over)} times what the detection "
                    "states"
                )


def _dishonest_poses(run: Run) -> Iterator[str]:
    """Of settings that assume the true camera: another one adds an error that no covariance knows of."""
    stated = [item for item in run.found if item.key["assumed_camera"] == EXACT]
    for item in stated:
        over = root(student(by_pose(item.normalised**2, poses_of(run, item)), _shared(len(stated))))
        if _is_dishonest(over):
            yield f"poses of {item.name} are off by {with_interval(over)} times what the solver states"


def _is_dishonest(over: Interval) -> bool:
    """Outside what is honest, and not by chance alone."""
    return not HONEST[0] <= over.value <= HONEST[1] and (over.low > 1.0 or over.high < 1.0)


def _shared(tests: int) -> float:
    """Level of each of some intervals that hold all together at `LEVEL` (Bonferroni)."""
    return 1.0 - (1.0 - LEVEL) / max(tests, 1)


def _named(run: Run, own: Mask) -> str:
    """Some frames by camera and number."""
    ids = np.array([frame["frame_id"] for frame in run.frames])
    by_camera = Counter(run.cameras[own].tolist())
    told = ", ".join(f"{count} of {name}" for name, count in by_camera.most_common(MOST_NAMED))
    return f"{told} (frames {_listed(ids[own].tolist())})"


def _listed(ids: Sequence[int]) -> str:
    return ", ".join(map(str, ids[:MOST_NAMED])) + (", …" if len(ids) > MOST_NAMED else "")
