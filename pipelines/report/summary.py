"""What a run found, in sentences: what was made, how good it is, and what deserves attention."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.pages.numbers import share, with_interval
from pipelines.report.attention import attention
from pipelines.report.data import Series
from pipelines.report.frame_points import FramePoints
from pipelines.report.run import Run, by_pose, counted, poses_of
from pipelines.statistics import FEW, Interval, bootstrap, median, root, student, wilson
from render.sensor.presets import regime_of

TRUTH = "truth"  # where points are the true ones, errors are rounding
MOST_NAMED = 8  # cameras in one sentence


@dataclass(frozen=True, slots=True)
class Summary:
    """The beginning of the report."""

    sentence: str
    facts: tuple[str, ...]
    attention: tuple[str, ...]  # empty if nothing stands out


def summarised(run: Run) -> Summary:
    """The sentences of a run that has been scored."""
    called = tuple(attention(run))
    best = _best(run)
    facts = [_rendered(run), *(text for item in run.points for text in _detected(run, item))]
    facts += [_solved(run, best)] if best else []
    facts.append(_failed(run))
    if called:
        more = len(called) - 1
        sentence = called[0] + (f"; {more} more below" if more else "")
    else:
        boards = "every board was found, " if run.points else ""
        sentence = f"Nothing stands out: {boards}every pose was solved, and errors are as large as stated"
    return Summary(f"{sentence}.", tuple(facts), called)


def _rendered(run: Run) -> str:
    cameras = list(dict.fromkeys(run.cameras.tolist()))
    poses = len({frame["pose_id"] for frame in run.frames})
    regime = regime_of(run.recipe.sensor)
    return (
        f"{counted(len(run.frames), 'frame')} rendered: {counted(poses, 'pose')} through "
        f"{counted(len(cameras), 'camera')} ({', '.join(cameras[:MOST_NAMED])}"
        f"{', …' if len(cameras) > MOST_NAMED else ''}), "
        f"{f'sensor regime {regime}' if regime else 'a sensor of the recipe'}."
    )


def _detected(run: Run, item: FramePoints) -> Iterator[str]:
    boards, circles = item.boards[item.shows], item.circle[item.circle_visible]
    if not len(boards):
        yield f"{item.detector} had no board to find: none can be seen."
        return
    yield (
        f"{item.detector} found {np.sum(boards)} of {counted(len(boards), 'board')} ({share(wilson(boards))}), "
        f"{np.sum(item.found)} of the {counted(int(np.sum(item.visible)), 'corner')} that can be seen, and "
        f"{np.sum(circles)} of {counted(len(circles), 'circle')}."
    )
    if not np.any(boards):
        return
    poses = run.poses(np.ones(len(item.corners), bool))
    rms = root(student(by_pose(item.square, poses)))
    bias = {
        "x": _bias(item.mean_x, poses),
        "y": _bias(item.mean_y, poses),
        "the radius": _bias(item.mean_radial, poses),
    }
    told = ", ".join(f"{with_interval(found, True)} px along {name}" for name, found in bias.items())
    normalised = root(student(by_pose(item.normalised, poses)))
    stated = f" It is {with_interval(normalised)} times what the detection states." if normalised.value > 0.0 else ""
    yield f"Corner error by {item.detector}: {with_interval(rms)} px RMS per axis.{stated} Bias: {told}."


def _best(run: Run) -> Series | None:
    """The setting with the smallest position error, of those that are given no true points."""
    scored = [item for item in run.found if item.key["point_source"] != TRUTH and np.any(np.isfinite(item.position_mm))]
    return min(scored, key=lambda item: float(np.nanmedian(item.position_mm)), default=None)


def _solved(run: Run, item: Series) -> str:
    """The errors of the best setting, in units of the bound where it states one."""
    turn, place = (
        bootstrap(by_pose(values, poses_of(run, item)), median, resamples=FEW)
        for values in (item.errors["rotation_error_deg"], item.position_mm)
    )
    told = (
        f"The best poses are those of {item.name}: the median rotation error is {with_interval(turn)}°, the median "
        f"position error {with_interval(place)} mm"
    )
    over = root(student(by_pose(item.normalised**2, poses_of(run, item))))
    if np.isnan(over.value):
        return f"{told}; no standard deviations are stated."
    return (
        f"{told}. Its errors are {with_interval(over)} times the smallest that an unbiased solver can have with these "
        "points, the Cramér-Rao bound."
    )


def _failed(run: Run) -> str:
    failed, n = sum(int(item.failed.sum()) for item in run.found), sum(len(item.failed) for item in run.found)
    if not failed:
        return f"No pose failed, of {n} estimates by {counted(len(run.found), 'setting')}."
    return f"{failed} of {n} estimates by {counted(len(run.found), 'setting')} failed."


def _bias(values: Array, poses: NDArray[np.int64]) -> Interval:
    return student(by_pose(values, poses))
