"""What a solver returns: an expected failure is a status with a NaN pose, never an exception."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from eposit.pose import Pose


class Status(StrEnum):
    """Outcome of one problem. Every value but OK comes with a NaN pose."""

    # From eposit's solvers.
    OK = "ok"  # a pose was found
    NON_FINITE = "non_finite"  # an image point is NaN or infinite
    OUTSIDE_LENS = "outside_lens"  # an image point that no ray of this lens reaches
    BEYOND_90_DEGREES = "beyond_90_degrees"  # a point at or beyond 90 degrees, where POSIT and EPOSIT have no equations
    COPLANAR = "coplanar"  # the points lie in one plane and the method cannot take that
    NOT_CONVERGED = "not_converged"  # the iteration stopped before its step fell below the tolerance
    NO_SOLUTION = "no_solution"  # the solver found no pose, or none with all points in front of the camera
    INCONSISTENT = "inconsistent"  # converged, but to a pose that does not reproduce the image points
    # From adapters of other solvers and from the stages of a pipeline.
    TOO_FEW_POINTS = "too_few_points"  # the solver needs more points than it was given
    UNSUPPORTED_LENS = "unsupported_lens"  # the solver has no equations for this lens
    SOLVER_ERROR = "solver_error"  # a user's function raised an exception or returned an invalid pose
    POINTS_MISSING = "points_missing"  # detection left fewer than four of the points asked for
    MISSING = "missing"  # a file of poses has no row for this frame


STATUS_TYPE = np.dtype(f"<U{max(len(status) for status in Status)}")
OK, STATUSES = 0, np.array(list(Status), STATUS_TYPE)  # inside solvers a status is its place in this array, an int8


def _all_points() -> Mask:
    """A single True, for any number of points."""
    return np.ones((), np.bool_)


@dataclass(frozen=True, slots=True)
class Solution:
    """Result of `solve` for one problem, or for a batch of b problems (then every field has a leading axis b).

    `status`, `iterations` and `reprojection_rmse_px` have both kinds as their type; np.asarray makes arrays of them.
    """

    status: str | NDArray[np.str_]  # a `Status`, or a (b,) array of their strings, which may be read-only
    cam_from_obj: Pose  # R (3, 3) and t (3,) in the unit of points_in_obj
    iterations: int | NDArray[np.int64]  # of the linear start and the refinement together
    reprojection_rmse_px: float | Array  # root of the mean squared distance between image points and reprojections, px
    covariance: Array  # (6, 6): rotation vector on the left in the camera frame (rad), then t; NaN for linear methods
    inliers: Mask = field(default_factory=_all_points)  # (n,) points in use: all unless `robust` left some out

    def first(self) -> Solution:
        """The single problem of a batch of one, without its leading axis."""
        pose = Pose(self.cam_from_obj.R[0], self.cam_from_obj.t[0])
        status, rmse = Status(str(np.asarray(self.status)[0])), float(np.asarray(self.reprojection_rmse_px)[0])
        inliers = self.inliers[0] if self.inliers.ndim else self.inliers
        return Solution(status, pose, int(np.asarray(self.iterations)[0]), rmse, self.covariance[0], inliers)


@dataclass(frozen=True, slots=True)
class SolutionBuffer:
    """Arrays that a solver writes the results of b problems to, chunk by chunk."""

    codes: NDArray[np.int8]  # (b,) statuses as places in STATUSES; shared with the problem, which marks failures there
    R: Array  # (b, 3, 3)
    t: Array  # (b, 3)
    iterations: NDArray[np.int64]  # (b,)
    rmse_px: Array  # (b,)
    covariance: Array  # (b, 6, 6), read-only NaN where the method states none

    @staticmethod
    def of(codes: NDArray[np.int8], with_covariance: bool) -> SolutionBuffer:
        """Uninitialised, but for the statuses and zero iterations."""
        b = len(codes)
        covariance = np.empty((b, 6, 6)) if with_covariance else np.broadcast_to(np.nan, (b, 6, 6))
        return SolutionBuffer(
            codes, np.empty((b, 3, 3)), np.empty((b, 3)), np.zeros(b, np.int64), np.empty(b), covariance
        )

    def part(self, rows: slice) -> SolutionBuffer:
        """Some rows; what is written there is written here."""
        return SolutionBuffer(
            self.codes[rows],
            self.R[rows],
            self.t[rows],
            self.iterations[rows],
            self.rmse_px[rows],
            self.covariance[rows],
        )

    def fill_with_nan(self) -> None:
        """Set the numbers to NaN, iterations to zero."""
        for values in (self.R, self.t, self.rmse_px, self.covariance):
            if values.flags.writeable:
                values[:] = np.nan
        self.iterations[:] = 0

    def solution(self) -> Solution:
        """The result as users get it."""
        return Solution(status_names(self.codes), Pose(self.R, self.t), self.iterations, self.rmse_px, self.covariance)


def status_names(codes: NDArray[np.int8]) -> NDArray[np.str_]:
    """Statuses of their places in `STATUSES`; read-only where all are OK, which then takes no memory."""
    return STATUSES[codes] if np.any(codes) else np.broadcast_to(STATUSES[OK], codes.shape)


def join(parts: list[Solution]) -> Solution:
    """One batch from several."""
    if len(parts) == 1:
        return parts[0]
    pose = Pose(*(np.concatenate([getattr(part.cam_from_obj, name) for part in parts]) for name in ("R", "t")))
    status, iterations, rmse, spread = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("status", "iterations", "reprojection_rmse_px", "covariance")
    )
    return Solution(status, pose, iterations, rmse, spread)
