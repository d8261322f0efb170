"""Numbers that the compiled solvers write, as solutions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from eposit.arrays import Array
from eposit.compiled.layout import (
    ALTERNATIVES,
    AMBIGUOUS,
    COVARIANCE,
    ITERATIONS,
    LINEAR_RESULT,
    OTHER,
    OTHERS,
    POSE,
    PRICE,
    RESULT,
    RMSE,
    STATUS,
    UNRELIABLE,
)
from eposit.pose import Pose
from eposit.solution import Alternatives, Solution, Status, status_names

CHUNK = 4096  # images after which a batch can be interrupted
BLOCKS = ((0, POSE), (POSE, POSE + 9), (POSE + 9, COVARIANCE), (COVARIANCE, OTHERS), (OTHERS, RESULT))
NO_COVARIANCE = np.broadcast_to(np.nan, (6, 6))
NO_ALTERNATIVES = Alternatives.none()
STATUS_OF = tuple(Status)

Run = Callable[[Array, int, int], None]  # writes results of the images from the first to the second number


def solve_one(run: Run, shape: tuple[int, int], width: int, variance: float) -> Solution:
    """The solution of a single image. shape: (1, n). variance: what its costs are to be divided by."""
    row, inliers = np.empty(width), np.ones(shape[1], np.bool_)
    run(row, 0, 1)
    code, steps, rmse, cost, ambiguous, unreliable = row[:POSE].tolist()
    pose = Pose(row[POSE : POSE + 9].reshape(3, 3), row[POSE + 9 : COVARIANCE])
    status, iterations = STATUS_OF[int(code)], int(steps)
    if width == LINEAR_RESULT:
        return Solution(status, pose, iterations, rmse, NO_COVARIANCE, inliers, cost, NO_ALTERNATIVES)
    others = row[OTHERS:].reshape(ALTERNATIVES, OTHER)
    alternatives = Alternatives(Pose(others[:, :9].reshape(-1, 3, 3), others[:, 9:12]), others[:, 12] / variance)
    covariance = row[COVARIANCE:OTHERS].reshape(6, 6)
    return Solution(
        status, pose, iterations, rmse, covariance, inliers, cost / variance, alternatives,
        ambiguous == 1.0, unreliable == 1.0,
    )  # fmt: skip


def solve_batch(run: Run, shape: tuple[int, int], width: int, variance: float) -> Solution:
    """The solutions of b images of n points. shape: (b, n). variance: what their costs are to be divided by."""
    b, n = shape
    out = np.empty(b * width)  # one array: a large one is given large pages of memory, several times faster
    for first in range(0, b, CHUNK):
        run(out, first, min(first + CHUNK, b))
    blocks = [out[b * start : b * stop].reshape(b, stop - start) for start, stop in BLOCKS if stop <= width]
    numbers, R, t, *rest = blocks
    status, pose = status_names(numbers[:, STATUS].astype(np.int8)), Pose(R.reshape(b, 3, 3), t)
    iterations, rmse, cost = numbers[:, ITERATIONS].astype(np.int64), numbers[:, RMSE].copy(), numbers[:, PRICE].copy()
    inliers = np.ones((b, n), np.bool_)
    if not rest:
        covariance = np.broadcast_to(np.nan, (b, 6, 6))
        return Solution(status, pose, iterations, rmse, covariance, inliers, cost)
    covariance, others = rest[0].reshape(b, 6, 6), rest[1].reshape(b, ALTERNATIVES, OTHER)
    other = Pose(others[..., :9].reshape(b, ALTERNATIVES, 3, 3), others[..., 9:12])
    return Solution(
        status, pose, iterations, rmse, covariance, inliers, cost / variance,
        Alternatives(other, others[..., 12] / variance),
        numbers[:, AMBIGUOUS] == 1.0, numbers[:, UNRELIABLE] == 1.0,
    )  # fmt: skip
