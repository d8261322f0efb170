"""Errors of one detector's points, by frame: what is kept of a frame once its points have been looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.report.data import frame_means
from pipelines.report.points import PointErrors


@dataclass(frozen=True, slots=True)
class FramePoints:
    """Of f frames, (f,) each: counts, means over a frame's corners and the circle; NaN where nothing was found."""

    detector: str
    visible: NDArray[np.int64]  # corners that can be seen
    found: NDArray[np.int64]  # of these, those that were found
    corners: NDArray[np.int64]  # corners that have an error
    made_up: NDArray[np.int64]  # points found that cannot be seen
    circle_visible: Mask
    circle: Mask  # whether the circle has an error
    mean_x: Array  # px, as are the next three
    mean_y: Array
    mean_radial: Array
    mean_along_x: Array
    square: Array  # mean of both axes' squares, px^2
    stated: NDArray[np.int64]  # corners with an error in units of the stated covariance
    normalised: Array  # mean square of these
    circle_square: Array
    circle_normalised: Array
    largest: Array  # length of the largest error of a corner, px
    largest_corner: NDArray[np.int64]  # which corner has it; 0 where none has

    @property
    def shows(self) -> Mask:
        """Whether anything of the target can be seen."""
        return (self.visible > 0) | self.circle_visible

    @property
    def boards(self) -> Mask:
        """Whether a board was found."""
        return self.corners > 0


def by_frame(item: PointErrors) -> FramePoints:
    """What is kept of some frames."""
    corners, circle = item.error[:, :-1], item.error[:, -1]
    seen = np.isfinite(item.error[..., 0])
    length = np.linalg.norm(corners, axis=-1)
    known = np.where(seen[:, :-1], length, -1.0)
    return FramePoints(
        item.detector,
        visible=np.sum(item.in_image[:, :-1], axis=1),
        found=np.sum(seen[:, :-1] & item.in_image[:, :-1], axis=1),
        corners=np.sum(seen[:, :-1], axis=1),
        made_up=np.sum(item.made_up, axis=1),
        circle_visible=item.in_image[:, -1],
        circle=seen[:, -1],
        mean_x=frame_means(corners[..., 0]),
        mean_y=frame_means(corners[..., 1]),
        mean_radial=frame_means(item.radial[:, :-1]),
        mean_along_x=frame_means(item.along_x[:, :-1]),
        square=frame_means(corners**2),
        stated=np.sum(np.isfinite(item.normalised[:, :-1, 0]), axis=1),
        normalised=frame_means(item.normalised[:, :-1] ** 2),
        circle_square=frame_means(circle**2),
        circle_normalised=frame_means(item.normalised[:, -1] ** 2),
        largest=np.where(np.any(seen[:, :-1], axis=1), np.max(known, axis=1), np.nan),
        largest_corner=np.argmax(known, axis=1),
    )


def joined(parts: Sequence[FramePoints]) -> FramePoints:
    """Some frames of a detector, and then others."""
    names = [field.name for field in fields(FramePoints)][1:]
    values = {name: np.concatenate([getattr(part, name) for part in parts]) for name in names}
    return FramePoints(parts[0].detector, **values)
