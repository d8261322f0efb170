"""What a run found, in sentences: what was made, how good it is, and what deserves attention."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.recipe.model import Recipe
from eposit.arrays import Array, Mask
from pipelines.pages.numbers import share, with_interval
from pipelines.report.data import EXACT, Series, frame_means
from pipelines.report.points import PointErrors
from pipelines.statistics import FEW, LEVEL, Interval, bootstrap, median, student, wilson
from render.sensor.presets import regime_of

HONEST = 0.8, 1.3  # normalised errors within are as good as stated
TRUTH = "truth"  # where points are the true ones, errors are rounding
MOST_NAMED = 8  # frames or cameras in one sentence


@dataclass(frozen=True, slots=True)
class Summary:
    """The beginning of the report."""

    sentence: str
    facts: tuple[str, ...]
    attention: tuple[str, ...]  # empty if nothing stands out


@dataclass(frozen=True, slots=True)
class Run:
    """What a summary is made from."""

    recipe: Recipe
    frames: list[dict[str, Any]]  # rows of `frames`
    points: list[PointErrors]  # one a detector, none if nothing was detected
    found: list[Series]

    @property
    def cameras(self) -> NDArray[np.str_]:
        """(f,) each frame's camera."""
        return np.array([frame["camera_name"] for frame in self.frames])

    def poses(self, own: Mask) -> NDArray[np.int64]:
        """Pose of each of some frames; frames of one pose differ by camera only, and are no independent samples."""
        return np.array([frame["pose_id"] for frame in self.frames])[own]


def summarised(run: Run) -> Summary:
    """The sentences of a run that has been scored."""
    attention = tuple(_attention(run))
    best = _best(run)
    facts = [_rendered(run), *(text for item in run.points for text in _detected(run, item))]
    facts += [_solved(run, best)] if best else []
    facts.append(_failed(run))
    if attention:
        more = len(attention) - 1
        sentence = attention[0] + (f"; {more} more below" if more else "")
    else:
        sentence = "Nothing stands out: every board was found, every pose solved, and errors are as large as stated"
    return Summary(f"{sentence}.", tuple(facts), attention)


def _rendered(run: Run) -> str:
    cameras = list(dict.fromkeys(run.cameras.tolist()))
    poses = len({frame["pose_id"] for frame in run.frames})
    regime = regime_of(run.recipe.sensor)
    return (
        f"{_count(len(run.frames), 'frame')} rendered: {_count(poses, 'pose')} through "
        f"{_count(len(cameras), 'camera')} ({', '.join(cameras[:MOST_NAMED])}"
        f"{', …' if len(cameras) > MOST_NAMED else ''}), "
        f"{f'sensor regime {regime}' if regime else 'a sensor of the recipe'}."
    )


def _detected(run: Run, item: PointErrors) -> Iterator[str]:
    seen = np.isfinite(item.error[..., 0])
    boards, corners, circles = seen[:, :-1].any(axis=1), seen[:, :-1] & item.in_image[:, :-1], seen[:, -1]
    there = item.in_image[:, :-1]
    yield (
        f"{item.detector} found {np.sum(boards)} of {_count(len(boards), 'board')} ({share(wilson(boards))}), "
        f"{np.sum(corners)} of the {_count(int(np.sum(there)), 'corner')} that lie in the pictures, and "
        f"{np.sum(circles)} of {_count(len(circles), 'circle')}."
    )
    if not np.any(boards):
        return
    poses = run.poses(np.ones(len(seen), bool))
    rms = _root(student(_by_pose(item.error[:, :-1] ** 2, poses)))
    bias = {
        "x": _bias(item.error[:, :-1, 0], poses),
        "y": _bias(item.error[:, :-1, 1], poses),
        "the radius": _bias(item.radial[:, :-1], poses),
    }
    told = ", ".join(f"{with_interval(found, True)} px along {name}" for name, found in bias.items())
    normalised = _root(student(_by_pose(item.normalised[:, :-1] ** 2, poses)))
    stated = f" It is {with_interval(normalised)} times what the detection states." if normalised.value > 0.0 else ""
    yield f"Corner error by {item.detector}: {with_interval(rms)} px RMS per axis.{stated} Bias: {told}."


def _best(run: Run) -> Series | None:
    """The setting with the smallest position error, of those that are given no true points."""
    scored = [item for item in run.found if item.key["point_source"] != TRUTH and not np.all(item.failed)]
    return min(scored, key=lambda item: float(np.nanmedian(item.position_mm)), default=None)


def _solved(run: Run, item: Series) -> str:
    """The errors of the best setting, in units of the bound where it states one."""
    turn, place = (
        bootstrap(_by_pose(values, _poses_of(run, item)), median, resamples=FEW)
        for values in (item.errors["rotation_error_deg"], item.position_mm)
    )
    told = (
        f"The best poses are those of {item.name}: the median rotation error is {with_interval(turn)}°, the median "
        f"position error {with_interval(place)} mm"
    )
    over = _root(student(_by_pose(item.normalised**2, _poses_of(run, item))))
    if np.isnan(over.value):
        return f"{told}; no standard deviations are stated."
    return (
        f"{told}. Its errors are {with_interval(over)} times the smallest that an unbiased solver can have with these "
        "points, the Cramér-Rao bound."
    )


def _failed(run: Run) -> str:
    failed, n = sum(int(item.failed.sum()) for item in run.found), sum(len(item.failed) for item in run.found)
    if not failed:
        return f"No pose failed, of {n} estimates by {_count(len(run.found), 'setting')}."
    return f"{failed} of {n} estimates by {_count(len(run.found), 'setting')} failed."


def _attention(run: Run) -> Iterator[str]:
    for item in run.points:
        yield from _not_found(run, item)
    for item in run.found:
        yield from _failures(item)
    for item in run.points:
        yield from _biased(run, item)
        yield from _dishonest_points(run, item)
    yield from _dishonest_poses(run)


def _not_found(run: Run, item: PointErrors) -> Iterator[str]:
    seen = np.isfinite(item.error[..., 0])
    lost = ~seen[:, :-1].any(axis=1)
    if np.any(lost):
        yield f"{item.detector} found no board in {_count(int(lost.sum()), 'frame')}: {_named(run, lost)}"
    missing = item.in_image[:, :-1] & ~seen[:, :-1] & ~lost[:, None]
    if np.any(missing):
        told = f"{item.detector} left out {_count(int(missing.sum()), 'corner')} of boards that it found, in "
        yield told + f"{_count(int(missing.any(axis=1).sum()), 'frame')}: {_named(run, missing.any(axis=1))}"
    circles = item.in_image[:, -1] & ~seen[:, -1] & ~lost
    if np.any(circles):
        told = f"{item.detector} found the board and not the circle in {_count(int(circles.sum()), 'frame')}"
        yield f"{told}: {_named(run, circles)}"


def _failures(item: Series) -> Iterator[str]:
    if np.any(item.failed):
        counts = Counter(item.status[item.failed].tolist())
        why = ", ".join(f"{count} {status}" for status, count in counts.most_common())
        yield f"{item.name} failed in {int(item.failed.sum())} of {len(item.failed)} estimates: {why}"
    wrong = item.gross & ~item.failed
    if np.any(wrong):
        told = f"{item.name} gave {_count(int(wrong.sum()), 'pose')} as ok whose position is wrong by its own length"
        yield f"{told} or more: frames {_listed(sorted(set(item.frame_id[wrong].tolist())))}"


def _biased(run: Run, item: PointErrors) -> Iterator[str]:
    """Means that are not zero, at 5 % over all cameras and directions together (Bonferroni)."""
    cameras = dict.fromkeys(run.cameras.tolist())
    kinds = (("x", item.error[:, :-1, 0]), ("y", item.error[:, :-1, 1]), ("the radius", item.radial[:, :-1]))
    level = _shared(len(cameras) * len(kinds))
    for camera in cameras:
        own = run.cameras == camera
        for name, values in kinds:
            found = student(_by_pose(values[own], run.poses(own)), level)
            if found.low > 0.0 or found.high < 0.0:
                told = f"corners of {item.detector} in {camera} are off by {with_interval(found, True)} px on average"
                yield f"{told} along {name}, more than chance explains"


def _dishonest_points(run: Run, item: PointErrors) -> Iterator[str]:
    cameras = dict.fromkeys(run.cameras.tolist())
    level = _shared(2 * len(cameras))
    for camera in cameras:
        own = run.cameras == camera
        for name, values in (("corners", item.normalised[own, :-1]), ("circles", item.normalised[own, -1:])):
            over = _root(student(_by_pose(values**2, run.poses(own)), level))
            if _is_dishonest(over):
                yield (
                    f"{name} of {item.detector} in {camera} are off by {with_interval(over)} times what the detection "
                    "states"
                )


def _dishonest_poses(run: Run) -> Iterator[str]:
    """Of settings that assume the true camera: another one adds an error that no covariance knows of."""
    stated = [item for item in run.found if item.key["assumed_camera"] == EXACT]
    for item in stated:
        over = _root(student(_by_pose(item.normalised**2, _poses_of(run, item)), _shared(len(stated))))
        if _is_dishonest(over):
            yield f"poses of {item.name} are off by {with_interval(over)} times what the solver states"


def _is_dishonest(over: Interval) -> bool:
    """Outside what is honest, and not by chance alone."""
    return not HONEST[0] <= over.value <= HONEST[1] and (over.low > 1.0 or over.high < 1.0)


def _poses_of(run: Run, item: Series) -> NDArray[np.int64]:
    """(n,) pose of each row."""
    by_frame = {frame["frame_id"]: frame["pose_id"] for frame in run.frames}
    return np.array([by_frame[int(frame)] for frame in item.frame_id])


def _by_pose(values: Array, poses: NDArray[np.int64]) -> Array:
    """(p,) mean over all that a pose's rows have, of (n, ...) values."""
    rows = frame_means(values)
    return np.array([np.nanmean(part) if np.any(np.isfinite(part)) else np.nan for part in _parts(rows, poses)])


def _parts(rows: Array, poses: NDArray[np.int64]) -> Iterable[Array]:
    return (rows[poses == pose] for pose in np.unique(poses))


def _bias(values: Array, poses: NDArray[np.int64]) -> Interval:
    return student(_by_pose(values, poses))


def _root(found: Interval) -> Interval:
    return Interval(*(float(np.sqrt(max(each, 0.0))) for each in (found.value, found.low, found.high)))


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


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
