"""What the methods of the experiment cost."""

from __future__ import annotations

import functools
import timeit
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from datasets.rows import decode_image
from datasets.store.dataset import Dataset
from eposit.arrays import Array
from pipelines.detection import detect_points
from pipelines.paper.experiment.pictures import Pictures, by_eposit, by_released
from pipelines.statistics import Interval, bootstrap, median

SOLVES = {by_eposit: 5, by_released: 1}  # of each picture, of which the shortest counts; the released may take seconds

PAPER_SOLVE_MS, PAPER_DETECT_MS = 0.1, 7.6  # EPOSIT alone, and with feature detection (the paper exchanges the two)


@dataclass(frozen=True, slots=True)
class Cost:
    """Median times of one picture, ms."""

    eposit: Interval
    released: Interval
    each_ms: dict[str, Array]  # by detector, (b,) of each picture, the decoding of the picture not counted

    @property
    def detection(self) -> dict[str, Interval]:
        """Medians by detector."""
        return {name: bootstrap(times, median) for name, times in self.each_ms.items()}


def timed(dataset: Dataset, pictures: Pictures, detectors: tuple[str, ...]) -> Cost:
    """Single calls on every picture that has the four points, and detection on every picture."""
    images = dataset.read("frames", ["frame_id", "image"]).to_pylist()
    pixels = [decode_image(row["image"], dataset.root, row["frame_id"]) for row in images]
    each_ms = {
        name: _shortest([functools.partial(detect_points, image, pictures.target, name) for image in pixels], 1)
        for name in detectors
    }
    eposit, released = (
        bootstrap(
            _shortest([functools.partial(_solve, pictures, i, solve) for i in range(len(pixels))], repeats), median
        )
        for solve, repeats in SOLVES.items()
    )
    return Cost(eposit, released, each_ms)


def _solve(pictures: Pictures, i: int, solve: Callable[..., object]) -> None:
    points = pictures.points_px[i, pictures.four]
    if np.all(np.isfinite(points)):
        solve(pictures.target.points[pictures.four], points, pictures.nominal, pictures.covariance_px2[i])


def _shortest(calls: list[Callable[[], object]], repeats: int) -> Array:
    """Each call's shortest time, ms."""
    return np.array([1e3 * min(timeit.repeat(call, number=1, repeat=repeats)) for call in calls])
