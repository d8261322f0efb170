"""Errors of poses over the pixels' Cramer-Rao bound."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from datasets.rows import POSITION_COLUMNS, QUATERNION_COLUMNS, pose_covariances, poses
from datasets.store.dataset import Dataset
from eposit.arrays import Array, Mask
from eposit.pose import rotation_error_vector
from pipelines.report.data import SETTING
from pipelines.statistics import squares_over

POSE = (*QUATERNION_COLUMNS, *POSITION_COLUMNS)
COVERED = 1.96  # stated deviations that 95 % of normal errors stay within


def bound_rows(dataset: Dataset) -> list[dict[str, Any]]:
    """For each setting and camera the root mean square error over the bound, and how often stated intervals cover.

    The error is that of six directions together: sqrt(e^T B^-1 e / 6) with B a frame's bound; 1 is the least that an
    unbiased solver reaches. Empty where no bounds were computed.
    """
    if not dataset.shards("bounds"):
        return []
    dataset.whole("bounds")
    sums: dict[tuple[str, str], _Sums] = {}
    for path in dataset.whole("estimates"):
        for key, own, squares, inside in _by_setting(dataset, path):
            sums.setdefault(key, _Sums()).add(squares[own], inside[own])
    return [
        {"setting": key[0], "camera": key[1], "n": item.count, "over": item.over, "covered": item.covered}
        for key, item in sums.items()
        if item.count
    ]


@dataclass(slots=True)
class _Sums:
    """Of one setting and camera, over the frames that were solved."""

    count: int = 0
    squares: float = 0.0
    inside: float = 0.0  # NaN where no deviations are stated

    def add(self, squares: Array, inside: Array) -> None:
        known = np.isfinite(squares)
        self.count += int(np.sum(known))
        self.squares += float(np.sum(squares[known]))
        self.inside += float(np.sum(inside[known]))

    @property
    def over(self) -> float:
        """The root mean square."""
        return float(np.sqrt(self.squares / self.count))

    @property
    def covered(self) -> float | None:
        """The share; None where it is not known."""
        return self.inside / self.count if np.isfinite(self.inside) else None


def _by_setting(dataset: Dataset, path: Path) -> Iterator[tuple[tuple[str, str], Mask, Array, Array]]:
    """Of a shard of estimates, for each setting and camera: these, its rows, and all rows' squares and shares."""
    estimates = dataset.read_shard(path)
    bounds = dataset.read_shard(dataset.sibling(path, "bounds"))
    bound = dict(zip(bounds["frame_id"].to_pylist(), pose_covariances(bounds), strict=True))
    frames = dataset.read_shard(dataset.sibling(path, "frames"), ["frame_id", "camera_name", *POSE])
    place = {frame: i for i, frame in enumerate(frames["frame_id"].to_pylist())}
    settings = [" ".join(key) for key in zip(*(estimates[name].to_pylist() for name in SETTING), strict=True)]
    ids = estimates["frame_id"].to_pylist()
    truth = poses(frames.take([place[frame] for frame in ids]))
    found = poses(estimates)
    error = np.hstack((rotation_error_vector(found.R, truth.R), found.t - truth.t))
    camera = frames["camera_name"].to_pylist()
    keys = [(setting, camera[place[frame]]) for setting, frame in zip(settings, ids, strict=True)]
    squares = _squares(error, np.array([bound[frame] for frame in ids]))
    inside = _inside(error, pose_covariances(estimates))
    for key in dict.fromkeys(keys):
        yield key, np.array([other == key for other in keys]), squares, inside


def _squares(error: Array, bound: Array) -> Array:
    """(n,) mean square of errors (n, 6) in units of bounds (n, 6, 6); NaN where either is missing."""
    squares = np.full(len(error), np.nan)
    known = np.all(np.isfinite(error), axis=1) & np.all(np.isfinite(bound), axis=(1, 2))
    with np.errstate(all="ignore"):  # of bounds that are none
        scale = np.sqrt(np.einsum("nii->ni", bound[known]))
        scaled = error[known] / scale
        correlation = bound[known] / (scale[:, :, None] * scale[:, None, :])
    squares[known] = squares_over(correlation, scaled) / scaled.shape[1]
    return squares


def _inside(error: Array, covariance: Array) -> Array:
    """(n,) share of the six errors that are within COVERED stated deviations; NaN where none are stated."""
    with np.errstate(invalid="ignore"):
        deviations = np.sqrt(np.einsum("nii->ni", covariance))
    inside = np.mean(np.abs(error) <= COVERED * deviations, axis=1)
    return np.where(np.all(np.isfinite(deviations), axis=1), inside, np.nan)
