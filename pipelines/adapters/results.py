"""One solver's answer to one image, and many of them as a `Solution`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit import Camera, Pose, Solution, Status
from eposit.arrays import Array
from eposit.solution import STATUS_TYPE

FARTHEST = 1e30  # of a position, in any unit: squares of it, and their covariances, are numbers that tables can have
MOST_LETTERS = 200  # of a status that a user's function or file gives


class Solver(Protocol):
    """A function that solves n points in one image, (n, 2) px, or in b images, (b, n, 2) px."""

    def __call__(
        self, points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, /, *, sigma_px: ArrayLike | None = None
    ) -> Solution:
        """Pose or poses; an expected failure is a status with a NaN pose."""
        ...


def _nan(*shape: int) -> Callable[[], Array]:
    return lambda: np.full(shape, np.nan)


@dataclass(frozen=True, slots=True)
class PoseResult:
    """The outcome of one image; every status but ok comes with NaN."""

    status: str  # a `Status`, or the reason that a user's function or file gives
    R: Array = field(default_factory=_nan(3, 3))  # (3, 3)
    t: Array = field(default_factory=_nan(3))  # (3,), the unit of points_in_obj
    iterations: int = 0
    covariance: Array = field(default_factory=_nan(6, 6))  # (6, 6) as in `Solution`, NaN: none stated


def pose_result(R: ArrayLike, t: ArrayLike) -> PoseResult:
    """A pose as an answer; one that is not finite, or beyond FARTHEST, is none. t: (3,) or (3, 1)."""
    rotation, position = np.asarray(R, dtype=np.float64), np.asarray(t, dtype=np.float64).reshape(3)
    if not (np.all(np.isfinite(rotation)) and np.all(np.abs(position) < FARTHEST)):
        return PoseResult(Status.NO_SOLUTION)
    return PoseResult(Status.OK, rotation, position)


def checked(points_in_obj: ArrayLike, points_px: ArrayLike) -> tuple[Array, Array, bool]:
    """(n, 3) object points, (b, n, 2) px, and whether one image was given instead of a batch.

    Raises:
        ValueError: wrong shapes, fewer than four points or object points that are not finite.
    """
    obj, pixels = np.asarray(points_in_obj, dtype=np.float64), np.asarray(points_px, dtype=np.float64)
    if obj.ndim != 2 or obj.shape[1] != 3 or len(obj) < 4 or not np.all(np.isfinite(obj)):
        raise ValueError(f"points_in_obj has shape {obj.shape}; it must be (n, 3), finite, with n of at least 4")
    if pixels.ndim not in (2, 3) or pixels.shape[-2:] != (len(obj), 2):
        raise ValueError(f"points_px has shape {pixels.shape}; it must be ({len(obj)}, 2) or (b, {len(obj)}, 2)")
    return obj, pixels.reshape(-1, len(obj), 2), pixels.ndim == 2


def rays(points_px: Array, camera: Camera) -> tuple[Array, NDArray[np.str_]]:
    """(b, n, 2) px to (b, n, 3) unit bearings and (b,) statuses: ok, non_finite or outside_lens."""
    finite = np.all(np.isfinite(points_px), axis=(1, 2))
    bearings = camera.bearing(np.where(finite[:, None, None], points_px, 0.0))
    status = np.full(len(points_px), Status.OK, dtype=STATUS_TYPE)
    status[np.any(np.isnan(bearings), axis=(1, 2))] = Status.OUTSIDE_LENS
    status[~finite] = Status.NON_FINITE
    return bearings, status


def rectified(points_px: Array, camera: Camera) -> tuple[Array, NDArray[np.str_]]:
    """(b, n, 2) px of any lens to those of a pinhole with the same matrix, and (b,) statuses as of `rays`.

    At and beyond 90 degrees a pinhole has no image: such an image has the status beyond_90_degrees.
    """
    bearings, status = rays(points_px, camera)
    status[(status == Status.OK) & np.any(bearings[..., 2] <= 0.0, axis=1)] = Status.BEYOND_90_DEGREES
    if camera.lens == "perspective":
        return points_px, status
    return camera.replace(lens="perspective", coefficients=()).project(bearings), status


def solve_each(
    points_in_obj: ArrayLike,
    points_px: ArrayLike,
    camera: Camera,
    solve_one: Callable[[Array, Array], PoseResult],
    seen: Callable[[Array, Camera], tuple[Array, NDArray[np.str_]]] = rectified,
) -> Solution:
    """Give a solver one image at a time.

    solve_one: from (n, 3) object points and one image as `seen` makes it, `rectified` px or `rays`.
    """
    obj, batch, single = checked(points_in_obj, points_px)
    images, statuses = seen(batch, camera)
    answers = [
        solve_one(obj, image) if status == Status.OK else PoseResult(str(status))
        for image, status in zip(images, statuses, strict=True)
    ]
    return gather(obj, batch, camera, answers, single)


def gather(
    points_in_obj: Array, points_px: Array, camera: Camera, answers: Sequence[PoseResult], single: bool
) -> Solution:
    """Answers to (b, n, 2) px as one `Solution`; for a single image without the leading axis."""
    batch = stack(answers)
    ok, rmse = np.asarray(batch.status) == Status.OK, np.asarray(batch.reprojection_rmse_px)
    pose = batch.cam_from_obj
    if np.any(ok):
        with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
            miss = camera.project(Pose(pose.R[ok], pose.t[ok]).apply(points_in_obj)) - points_px[ok]
            rmse[ok] = np.sqrt(np.mean(np.sum(miss**2, axis=-1), axis=-1))
    if not single:
        return batch
    status, iterations = str(np.asarray(batch.status)[0]), int(np.asarray(batch.iterations)[0])
    return Solution(status, Pose(pose.R[0], pose.t[0]), iterations, float(rmse[0]), batch.covariance[0])


def stack(answers: Sequence[PoseResult]) -> Solution:
    """b answers as one batch, without reprojection errors (NaN)."""
    b = len(answers)
    R = np.array([answer.R for answer in answers]).reshape(b, 3, 3)
    t = np.array([answer.t for answer in answers]).reshape(b, 3)
    status = np.array([str(answer.status) for answer in answers], dtype=np.str_)
    iterations = np.array([answer.iterations for answer in answers], dtype=np.int64)
    covariance = np.array([answer.covariance for answer in answers]).reshape(b, 6, 6)
    return Solution(status, Pose(R, t), iterations, np.full(b, np.nan), covariance)
