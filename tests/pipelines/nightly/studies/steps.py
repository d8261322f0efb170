"""The poses that the solver passed on its way: what it would have returned, had it stopped earlier."""

from __future__ import annotations

import dataclasses
from contextlib import contextmanager
from unittest import mock

import numpy as np

from eposit import Pose
from eposit.refine import minimise


@contextmanager
def recorded():
    """While the body runs, every step of the refinement: pose before and after, R (3, 3, b) and t (3, b)."""
    steps, real = [], minimise.moved

    def moved(R, t, move):
        after = real(R, t, move)
        steps.append(((R, t), after))
        return after

    with mock.patch.object(minimise, "moved", moved):
        yield steps


def earlier(solution, steps, count):
    """A solution of one image with the pose of `count` steps before its last, or the first one if it took fewer."""
    R, t = solution.cam_from_obj.R[0], solution.cam_from_obj.t[0]
    for _ in range(count):
        R, t = _before(R, t, steps)
    return dataclasses.replace(solution, cam_from_obj=Pose(R[None], t[None]))


def _before(R, t, steps):
    for (R_before, t_before), (R_after, t_after) in reversed(steps):
        if np.any(same := np.all(R_after == R[..., None], axis=(0, 1)) & np.all(t_after == t[:, None], axis=0)):
            column = int(np.argmax(same))
            found = R_before[..., column].copy(), t_before[..., column].copy()
            if not (np.array_equal(found[0], R) and np.array_equal(found[1], t)):
                return found
    return R, t
