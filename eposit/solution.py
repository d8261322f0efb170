"""What a solver returns: an expected failure is a status with a NaN pose, never an exception."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

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
    COPLANAR = "coplanar"  # the points lie in one plane and the method cannot take that, or on one line
    NOT_CONVERGED = "not_converged"  # the iteration stopped before its step fell below the tolerance
    NO_SOLUTION = "no_solution"  # the solver found no pose, or none with all points in front of the camera
    INCONSISTENT = "inconsistent"  # converged, but to a pose that does not reproduce the image points
    # From adapters of other solvers and from the stages of a pipeline.
    TOO_FEW_POINTS = "too_few_points"  # the solver needs more points, or more that differ, than it was given
    UNSUPPORTED_LENS = "unsupported_lens"  # the solver has no equations for this lens
    SOLVER_ERROR = "solver_error"  # a user's function raised an exception or returned an invalid pose
    POINTS_MISSING = "points_missing"  # detection left fewer than four of the points asked for
    MISSING = "missing"  # a file of poses has no row for this frame


STATUS_TYPE = np.dtype(f"<U{max(len(status) for status in Status)}")
OK, STATUSES = 0, np.array(list(Status), STATUS_TYPE)  # inside solvers a status is its place in this array, an int8


@dataclass(frozen=True, slots=True)
class Alternatives:
    """Other local minima of the reprojection error, the cheapest first; NaN after the last. For a batch (b, k, ...)."""

    cam_from_obj: Pose  # R (k, 3, 3) and t (k, 3)
    cost: Array  # (k,) sums of squared residuals, as `Solution.cost`

    @staticmethod
    def none() -> Alternatives:
        """Of a method that looks for one pose."""
        return Alternatives(Pose(np.empty((0, 3, 3)), np.empty((0, 3))), np.empty(0))

    def first(self) -> Alternatives:
        """Those of the first problem of a batch."""
        if self.cost.ndim == 1:
            return self
        return Alternatives(Pose(self.cam_from_obj.R[0], self.cam_from_obj.t[0]), self.cost[0])


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
    cost: float | Array = np.nan  # sum of squared residuals, px^2, or over their variances where sigma is known
    alternatives: Alternatives = field(default_factory=Alternatives.none)
    ambiguous: bool | Mask = False  # an alternative is nearly as likely: the data do not decide between them
    covariance_unreliable: bool | Mask = False  # the cost is not the parabola that it states, or contradicts sigma

    def first(self) -> Solution:
        """The single problem of a batch of one, without its leading axis."""
        pose = Pose(self.cam_from_obj.R[0], self.cam_from_obj.t[0])
        status, rmse = Status(str(np.asarray(self.status)[0])), float(np.asarray(self.reprojection_rmse_px)[0])
        inliers = self.inliers[0] if self.inliers.ndim else self.inliers
        iterations, alternatives = int(np.asarray(self.iterations)[0]), self.alternatives.first()
        cost = float(np.ravel(self.cost)[0])
        flags = (bool(np.ravel(flag)[0]) for flag in (self.ambiguous, self.covariance_unreliable))
        return Solution(status, pose, iterations, rmse, self.covariance[0], inliers, cost, alternatives, *flags)


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
    fields = [_fields(part) for part in parts]
    return _from_fields(*(np.concatenate(values) for values in zip(*fields, strict=True)))


def in_order(solution: Solution, rows: NDArray[np.int64]) -> Solution:
    """A batch whose problem i belongs in row rows[i]."""
    order = np.argsort(rows)
    return _from_fields(*(values[order] for values in _fields(solution)))


def without_pose(solution: Solution, failed: Mask, reason: Status) -> Solution:
    """A batch in which the OK problems that have failed get the reason as their status, and NaN."""
    failed = failed & (np.asarray(solution.status) == Status.OK)
    if not np.any(failed):
        return solution
    status, *rest = (values.copy() for values in _fields(solution))
    status[failed] = reason
    for values in rest:
        if values.dtype == np.float64:
            values[failed] = np.nan
    return _from_fields(status, *rest)


def _fields(solution: Solution) -> list[NDArray[Any]]:
    """The arrays of a batch, each with its leading axis."""
    pose, others, b = solution.cam_from_obj, solution.alternatives, len(np.asarray(solution.status))
    per_problem = (solution.cost, solution.ambiguous, solution.covariance_unreliable)
    inliers = solution.inliers if solution.inliers.ndim == 2 else np.broadcast_to(solution.inliers, (b, 1))
    other = (
        others
        if others.cost.ndim == 2
        else Alternatives(Pose(np.empty((b, 0, 3, 3)), np.empty((b, 0, 3))), np.empty((b, 0)))
    )
    return [
        np.asarray(solution.status, STATUS_TYPE), pose.R, pose.t, np.asarray(solution.iterations),
        np.asarray(solution.reprojection_rmse_px), solution.covariance, inliers,
        *(np.broadcast_to(np.asarray(values), (b,)) for values in per_problem),
        other.cam_from_obj.R, other.cam_from_obj.t, other.cost,
    ]  # fmt: skip


def _from_fields(
    status: Any, R: Array, t: Array, iterations: Any, rmse: Array, spread: Array, inliers: Mask, cost: Array,
    ambiguous: Mask, unreliable: Mask, other_R: Array, other_t: Array, other_cost: Array,
) -> Solution:  # fmt: skip
    others = Alternatives(Pose(other_R, other_t), other_cost)
    return Solution(status, Pose(R, t), iterations, rmse, spread, inliers, cost, others, ambiguous, unreliable)
