"""Numbers that the compiled solvers write, as solutions."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache

import numpy as np

from eposit.arrays import Mask
from eposit.camera import Camera
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
from eposit.workspace import give_back, lend

CHUNK = 4096  # images after which a batch can be interrupted
BLOCKS = ((0, POSE), (POSE, POSE + 9), (POSE + 9, COVARIANCE), (COVARIANCE, OTHERS), (OTHERS, RESULT))
NO_COVARIANCE = np.broadcast_to(np.nan, (6, 6))
NO_ALTERNATIVES = Alternatives.none()  # of a method that looks for one pose
NO_OTHERS = Alternatives(
    Pose(np.broadcast_to(np.nan, (ALTERNATIVES, 3, 3)), np.broadcast_to(np.nan, (ALTERNATIVES, 3))),
    np.broadcast_to(np.nan, (ALTERNATIVES,)),
)  # of one that has found no more than the pose
STATUS_OF = tuple(Status)

# Given the address of a workspace and of the results, computes those of the images from the first to the second number.
Run = Callable[[int, int, int, int], None]


def solve_one(run: Run, camera: Camera, shape: tuple[int, int], width: int, variance: float) -> Solution:
    """The solution of a single image. shape: (1, n). variance: what its costs are to be divided by."""
    workspace = lend(camera, shape[1])
    try:
        run(workspace.address, workspace.result_address, 0, 1)
        row = workspace.result[:width].copy()
    finally:
        give_back(workspace)
    inliers = _all_in_use(shape[1]).copy()
    code, steps, rmse, cost, ambiguous, unreliable = row[:POSE].tolist()
    pose = Pose(row[POSE : POSE + 9].reshape(3, 3), row[POSE + 9 : COVARIANCE])
    status, iterations = STATUS_OF[int(code)], int(steps)
    if width == LINEAR_RESULT:
        return Solution(status, pose, iterations, rmse, NO_COVARIANCE, inliers, cost, NO_ALTERNATIVES)
    alternatives = NO_OTHERS
    if not math.isnan(row[OTHERS]):
        others = row[OTHERS:].reshape(ALTERNATIVES, OTHER)
        alternatives = Alternatives(Pose(others[:, :9].reshape(-1, 3, 3), others[:, 9:12]), others[:, 12] / variance)
    covariance = row[COVARIANCE:OTHERS].reshape(6, 6)
    return Solution(
        status, pose, iterations, rmse, covariance, inliers, cost / variance, alternatives,
        ambiguous == 1.0, unreliable == 1.0,
    )  # fmt: skip


@lru_cache(maxsize=64)
def _all_in_use(n: int) -> Mask:
    return np.ones(n, np.bool_)


def solve_batch(run: Run, camera: Camera, shape: tuple[int, int], width: int, variance: float) -> Solution:
    """The solutions of b images of n points. shape: (b, n). variance: what their costs are to be divided by."""
    b, n = shape
    out = np.empty(b * width)  # one array: a large one is given large pages of memory, several times faster
    workspace, address = lend(camera, n), out.ctypes.data
    try:
        for first in range(0, b, CHUNK):
            run(workspace.address, address, first, min(first + CHUNK, b))
    finally:
        give_back(workspace)
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
