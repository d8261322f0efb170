"""What a report shows, as plain arrays and rows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from datasets.rows import numbers
from datasets.schema import COMPONENTS
from eposit import Status
from eposit.arrays import Array, Mask
from pipelines.stages.failures import HIDDEN
from pipelines.statistics import FEW, Interval, bootstrap, median, rate, student, tail

ERRORS = {
    "rotation_error_deg": "rotation, deg",
    "rx_error_deg": "rx, deg",
    "ry_error_deg": "ry, deg",
    "rz_error_deg": "rz, deg",
    "tx_error_mm": "x, mm",
    "ty_error_mm": "y, mm",
    "tz_error_mm": "z, mm",
    "t_error_relative": "translation, relative",
    "reprojection_rmse_px": "reprojection, px",
}
SIGNED = tuple(name for name in ERRORS if name[:2] in ("rx", "ry", "rz", "tx", "ty", "tz"))
SETTING = ("solver", "point_source", "assumed_camera", "point_set")
NORMALISED = tuple(f"{component}_normalised" for component in COMPONENTS)
FLAGS = ("gross_failure", "ambiguous", "covariance_unreliable")
SCORE_COLUMNS = ("frame_id", *SETTING, "status", "failure_reason", *FLAGS, *ERRORS, *NORMALISED)
EXACT = "exact"  # the assumed camera that is the true one


@dataclass(frozen=True, slots=True)
class Series:
    """Scores of one setting."""

    name: str
    key: dict[str, str]  # its columns of SETTING
    frame_id: NDArray[np.int64]
    errors: dict[str, Array]  # column to values, NaN for failures
    normalised: Array  # (n, 6) errors over their stated standard deviations, NaN without
    status: NDArray[np.str_]  # HIDDEN where no pose could be found, as the target cannot be seen
    gross: Mask
    ambiguous: Mask  # poses of which the solver says that another is nearly as likely
    unreliable: Mask  # poses of which the solver says that the stated covariance is not to be relied on

    @property
    def failed(self) -> Mask:
        """Rows without a pose, of a target that can be seen."""
        return (self.status != Status.OK) & (self.status != HIDDEN)

    @property
    def position_mm(self) -> Array:
        """Length of the translation error."""
        return np.sqrt(sum(self.errors[f"t{axis}_error_mm"] ** 2 for axis in "xyz"))


@dataclass(frozen=True, slots=True)
class Error:
    """One kind of error of one setting and camera, over the frames that were solved."""

    label: str
    median: Interval  # of absolute errors
    tail: Interval | None  # their 95th percentile; None with too few frames
    mean: Interval | None  # None for errors that have no sign


@dataclass(frozen=True, slots=True)
class Cell:
    """Scores of one setting through one camera."""

    setting: str
    camera: str
    frames: int
    n: int  # estimates: frames times draws
    failed: int
    gross: int
    ambiguous: int
    unreliable: int
    failed_rate: Interval
    gross_rate: Interval
    rotation_deg: Interval | None  # medians of absolute errors, None if all failed
    position_mm: Interval | None
    normalised: float  # RMS of the six errors over their stated standard deviations, NaN without
    errors: tuple[Error, ...]  # none if all failed


def series(tables: Iterable[pa.Table]) -> list[Series]:
    """One series for each setting, in the order of its rows in tables of scores, which are looked at one by one."""
    parts: dict[tuple[str, ...], list[Series]] = {}
    for scores in tables:
        for item in _series_of(scores):
            parts.setdefault(tuple(item.key.values()), []).append(item)
    return [_joined(own) for own in parts.values()]


def _joined(parts: Sequence[Series]) -> Series:
    """Some rows of a setting, and then others."""
    return Series(
        parts[0].name,
        parts[0].key,
        np.concatenate([part.frame_id for part in parts]),
        {name: np.concatenate([part.errors[name] for part in parts]) for name in parts[0].errors},
        np.concatenate([part.normalised for part in parts]),
        np.concatenate([part.status for part in parts]),
        np.concatenate([part.gross for part in parts]),
        np.concatenate([part.ambiguous for part in parts]),
        np.concatenate([part.unreliable for part in parts]),
    )


def _series_of(scores: pa.Table) -> list[Series]:
    keys = list(zip(*(scores[name].to_pylist() for name in SETTING), strict=True))
    found: list[Series] = []
    for key in dict.fromkeys(keys):
        part = scores.filter(pa.array([other == key for other in keys]))
        errors = dict(zip(ERRORS, numbers(part, *ERRORS).T, strict=True))
        outcome = zip(part["status"].to_pylist(), part["failure_reason"].to_pylist(), strict=True)
        status = np.array([HIDDEN if reason == HIDDEN else status for status, reason in outcome], str)
        flags = (np.array([bool(value) for value in part[name].to_pylist()], bool) for name in FLAGS)
        normalised = numbers(part, *NORMALISED)
        named: dict[str, str] = dict(zip(SETTING, key, strict=True))
        frame_id = part["frame_id"].to_numpy()
        found.append(Series(" ".join(key), named, frame_id, errors, normalised, status, *flags))
    return found


def cells(found: list[Series], cameras: dict[int, str]) -> list[Cell]:
    """Errors and failures for each setting and camera, with intervals over the frames; a frame's draws stay together.

    cameras: by frame_id.
    """
    return [
        _cell(item, name, by_frame)
        for item in found
        for name, by_frame in _by_camera(item, np.array([cameras[int(frame)] for frame in item.frame_id]))
    ]


def normalised_rows(found: list[Series]) -> list[dict[str, Any]]:
    """RMS of the normalised errors of each setting that states covariances."""
    rows: list[dict[str, Any]] = []
    for item in found:
        stated = item.normalised[np.all(np.isfinite(item.normalised), axis=1)]
        if len(stated):
            rows.append({"setting": item.name, "n": len(stated), "rms": np.sqrt(np.mean(stated**2, axis=0)).tolist()})
    return rows


def _by_camera(item: Series, camera: NDArray[np.str_]) -> Iterator[tuple[str, NDArray[np.intp]]]:
    """Each camera, and (frames, draws) the rows of its frames: every frame has all draws."""
    for name in dict.fromkeys(camera.tolist()):
        own = np.flatnonzero(camera == name)
        order = own[np.argsort(item.frame_id[own], kind="stable")]
        yield name, order.reshape(len(np.unique(item.frame_id[own])), -1)


def _cell(item: Series, camera: str, by_frame: NDArray[np.intp]) -> Cell:
    failed, gross = item.failed[by_frame], item.gross[by_frame]
    errors = {name: np.where(failed, np.nan, values[by_frame]) for name, values in item.errors.items()}
    solved = not np.all(failed)
    normalised = item.normalised[by_frame]
    known = np.all(np.isfinite(normalised), axis=-1)
    return Cell(
        item.name,
        camera,
        len(by_frame),
        by_frame.size,
        int(failed.sum()),
        int(gross.sum()),
        int(item.ambiguous[by_frame].sum()),
        int(item.unreliable[by_frame].sum()),
        rate(failed),
        rate(gross),
        _median(errors["rotation_error_deg"]) if solved else None,
        _median(np.where(failed, np.nan, item.position_mm[by_frame])) if solved else None,
        float(np.sqrt(np.mean(normalised[known] ** 2))) if np.any(known) else np.nan,
        tuple(_error(name, values) for name, values in errors.items()) if solved else (),
    )


def _error(name: str, values: Array) -> Error:
    """values: (frames, draws)"""
    mean = student(frame_means(values)) if name in SIGNED else None
    return Error(ERRORS[name], _median(np.abs(values)), tail(np.abs(values)), mean)


def _median(values: Array) -> Interval:
    return bootstrap(values, median, resamples=FEW)


def frame_means(values: Array) -> Array:
    """(f,) mean of all that a frame has, of (f, ...) values; NaN where it has none."""
    flat = values.reshape(len(values), -1)
    count = np.sum(np.isfinite(flat), axis=1)
    with np.errstate(invalid="ignore"):
        return np.nansum(flat, axis=1) / count
