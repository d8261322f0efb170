"""What the solvers of unknown intrinsics share: their input, the camera they estimate, and their result.

Pixels become offsets from the principal point in units in which the pixel is square: x = u - cx, y = (v - cy) / aspect.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask
from eposit.camera import Camera
from eposit.least_squares import Minima
from eposit.pose import Pose
from eposit.problem import validate
from eposit.solution import OK, STATUS_TYPE, Solution, Status

CHUNK = 1024  # problems worked on at a time


@dataclass(frozen=True, slots=True)
class Division:
    """A camera with radial distortion in one parameter; k = 0 is the pinhole. One camera, or s of them: (s...) arrays.

    A point at (x, y) from the principal point, r = |(x, y)|, lies on the ray (x, y, f (1 + k r^2)): k = -1 / (4 f^2) is
    the stereographic lens, and a negative k reaches beyond 90 degrees.
    Source:
        Fitzgibbon 2001, "Simultaneous linear estimation of multiple view geometry and lens distortion", equation 5.
    """

    f_px: float | Array  # focal length along x, px; NaN where there is no estimate
    k_per_px2: float | Array  # distortion, px^-2
    cx: float  # principal point, px
    cy: float  # principal point, px
    aspect: float  # fy / fx

    def project(self, points_in_cam: ArrayLike) -> Array:
        """(..., 3) points, or (s..., n, 3) for s cameras, to (..., 2) px; NaN where the model has no image.

        Source:
            r Z = f R (1 + k r^2) with R = |(X, Y)|; of its two roots the one that is 0 on the axis.
        """
        x, y, z = np.moveaxis(np.asarray(points_in_cam, dtype=np.float64), -1, 0)
        f, k = self._of_each_point()
        side2 = x * x + y * y
        with np.errstate(invalid="ignore", divide="ignore"):
            below = z + np.sqrt(z * z - 4.0 * k * f * f * side2)
            scale = 2.0 * f / np.where(below > 0.0, below, np.nan)
        return np.stack((x * scale + self.cx, y * scale * self.aspect + self.cy), axis=-1)

    def bearing(self, points_px: ArrayLike) -> Array:
        """(..., 2) px, or (s..., n, 2) for s cameras, to (..., 3) unit vectors in the camera frame."""
        pixels = np.asarray(points_px, dtype=np.float64)
        x, y = pixels[..., 0] - self.cx, (pixels[..., 1] - self.cy) / self.aspect
        f, k = self._of_each_point()
        z = f * (1.0 + k * (x * x + y * y))
        length = np.sqrt(x * x + y * y + z * z)
        return np.stack((x / length, y / length, z / length), axis=-1)

    def _of_each_point(self) -> tuple[Array, Array]:
        f, k = np.asarray(self.f_px, dtype=np.float64), np.asarray(self.k_per_px2, dtype=np.float64)
        return (f[..., None], k[..., None]) if f.ndim else (f, k)


@dataclass(frozen=True, slots=True)
class CameraCandidates:
    """Every real solution with f > 0 of one problem, (k,) rows, or of b problems, (b, k); NaN after the last one."""

    poses: Pose  # R (..., k, 3, 3), t (..., k, 3)
    cost: Array  # (..., k) sum of squared reprojection errors, px^2; NaN where a point is not in front of the camera
    f_px: Array  # (..., k) focal length along x, px
    k_per_px2: Array  # (..., k) distortion, px^-2
    steps: NDArray[np.int64]  # (..., k) of the least squares; 0 after the last candidate
    converged: Mask  # (..., k) it is a minimum (GPnPf) or reproduces its points (PnPfr); False after the last candidate
    count: int | NDArray[np.int64]  # how many there are, of one problem or (b,)


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate(Solution):
    """A `Solution` with the estimated camera and all candidates. The covariance is NaN: nothing here estimates it."""

    camera: Division  # the estimated one
    candidates: CameraCandidates

    def first(self) -> Estimate:
        """The single problem of a batch of one, without its leading axis."""
        plain = Solution(self.status, self.cam_from_obj, self.iterations, self.reprojection_rmse_px, self.covariance)
        one, camera, found = Solution.first(plain), self.camera, self.candidates
        f, k = float(np.asarray(camera.f_px)[0]), float(np.asarray(camera.k_per_px2)[0])
        camera = Division(f, k, camera.cx, camera.cy, camera.aspect)
        poses = Pose(found.poses.R[0], found.poses.t[0])
        arrays = (found.cost[0], found.f_px[0], found.k_per_px2[0], found.steps[0], found.converged[0])
        candidates = CameraCandidates(poses, *arrays, int(np.asarray(found.count)[0]))
        rmse, spread = one.reprojection_rmse_px, one.covariance
        return Estimate(
            one.status, one.cam_from_obj, one.iterations, rmse, spread, camera=camera, candidates=candidates
        )


@dataclass(frozen=True, slots=True)
class Images:
    """Validated input: b images of the same n object points."""

    points_in_obj: Array  # (n, 3)
    points_px: Array  # (b, n, 2), a harmless pattern where a row is not finite
    finite: Mask  # (b,)
    camera: Camera  # of which the principal point and the aspect are used
    single: bool

    @property
    def offsets(self) -> Array:
        """(b, n, 2) offsets from the principal point, px, y divided by the aspect."""
        camera = self.camera
        return (self.points_px - (camera.cx, camera.cy)) * (1.0, camera.fx / camera.fy)


def read(points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, sigma_px: ArrayLike | None) -> Images:
    """The input as arrays.

    Raises:
        ValueError: wrong shapes, fewer than four points, non-finite object points, or a wrong sigma.
    """
    problem, single = validate(points_in_obj, points_px, camera, sigma_px)
    finite, count = problem.status == OK, len(problem.points_in_obj)
    pattern = np.stack((np.arange(count) + 1.0, np.arange(count) ** 2.0), axis=-1)
    pixels = np.where(finite[:, None, None], problem.points_px, pattern)
    return Images(problem.points_in_obj, pixels, finite, camera, single)


def in_chunks(images: Images, candidates_of: Callable[[Array], CameraCandidates]) -> CameraCandidates:
    """CameraCandidates of all images, worked out in pieces whose arrays stay in the cache."""
    offsets = images.offsets
    parts = [candidates_of(offsets[i : i + CHUNK]) for i in range(0, max(1, len(offsets)), CHUNK)]
    R, t = (np.concatenate([getattr(part.poses, name) for part in parts]) for name in ("R", "t"))
    names = ("cost", "f_px", "k_per_px2", "steps", "converged", "count")
    return CameraCandidates(Pose(R, t), *(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def table(
    width: int, rows: NDArray[np.int64], b: int, pose: Pose, f_px: Array, k_per_px2: Array, minima: Minima
) -> CameraCandidates:
    """CameraCandidates (m, ...) of the problems `rows` (m,), in rising order, spread over (b, width); no cost yet."""
    count = np.bincount(rows, minlength=b)
    column = np.arange(len(rows)) - np.repeat(np.cumsum(count) - count, count)

    def spread(values: NDArray[Any], empty: float) -> NDArray[Any]:
        wide = np.full((b, width, *values.shape[1:]), empty, values.dtype)
        wide[rows, column] = values
        return wide

    poses = Pose(spread(pose.R, np.nan), spread(pose.t, np.nan))
    f, k = spread(f_px, np.nan), spread(k_per_px2, np.nan)
    steps, converged = spread(minima.steps, 0), spread(minima.converged, False)
    return CameraCandidates(poses, np.full((b, width), np.nan), f, k, steps, converged, count)


def reprojection_squares(images: Images, found: CameraCandidates) -> Array:
    """(b, k) sum of squared reprojection errors, px^2; NaN where a point has no image under the estimated camera."""
    camera = images.camera
    estimated = Division(found.f_px, found.k_per_px2, camera.cx, camera.cy, camera.fy / camera.fx)
    seen = found.poses.R @ images.points_in_obj.T + found.poses.t[..., None]  # (b, k, 3, n)
    return np.sum((estimated.project(np.swapaxes(seen, -1, -2)) - images.points_px[:, None]) ** 2, axis=(-1, -2))


def choose(images: Images, found: CameraCandidates, rank: Array, unusable: Status | None = None) -> Estimate:
    """The candidate of lowest finite rank (b, k) of each image, the earlier of equals.

    NaN pose where there is none, and where the limit of steps stopped its least squares: more steps may lead elsewhere.
    """
    b = np.arange(len(rank))
    order = np.where(np.isfinite(rank), rank, np.inf)
    best = np.argmin(order, axis=1)
    status = np.where(np.isfinite(order[b, best]), Status.OK, Status.NO_SOLUTION).astype(STATUS_TYPE)
    status[(status == Status.OK) & ~found.converged[b, best]] = Status.NOT_CONVERGED
    if unusable is not None:
        status[:] = unusable
    status[~images.finite] = Status.NON_FINITE
    ok = status == Status.OK
    R, t = np.where(ok[:, None, None], found.poses.R[b, best], np.nan), found.poses.t[b, best]
    f, k = np.where(ok, found.f_px[b, best], np.nan), np.where(ok, found.k_per_px2[b, best], np.nan)
    rmse = np.where(ok, np.sqrt(found.cost[b, best] / len(images.points_in_obj)), np.nan)
    camera = images.camera
    estimated = Division(f, k, camera.cx, camera.cy, camera.fy / camera.fx)
    pose, spread = Pose(R, np.where(ok[:, None], t, np.nan)), np.full((len(b), 6, 6), np.nan)
    taken = found.steps[b, best]
    estimate = Estimate(status, pose, taken, rmse, spread, camera=estimated, candidates=found)
    return estimate.first() if images.single else estimate
