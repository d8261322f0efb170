"""Compiled functions called from tests, by their address, on a workspace of their own."""

from __future__ import annotations

from typing import Any

import numpy as np

from eposit import Camera, Pose
from eposit.compiled import layout
from eposit.compiled.machine_code import native
from eposit.problem import as_weights
from eposit.workspace import Workspace

POSE = layout.STARTS  # place of a pose under test


def call(function: Any, w: np.ndarray, *args: float) -> Any:
    """What a compiled function returns."""
    return native(function)(w.ctypes.data, *args)


def problem(camera: Camera, points: np.ndarray, pixels: np.ndarray, sigma_px: Any = None) -> np.ndarray:
    """A workspace with the object about its centroid and one image of it, (n, 2)."""
    from eposit.compiled.shape import describe

    n = len(points)
    whole = Workspace(n)
    whole.write(camera)
    w = whole.numbers

    def rows(place: int, width: int) -> np.ndarray:
        start = layout.POINTS + place * n
        return w[start : start + width * n].reshape(n, width)

    rows(0, 3)[:] = points
    assert call(describe, w, n) == 0
    rows(layout.SEEN, 2)[:] = (pixels - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    rows(layout.RAYS, 3)[:] = camera.bearing(pixels)
    weights, _ = as_weights(sigma_px, n)
    rows(layout.INFO, 3)[:] = weights * [camera.fx**2, camera.fx * camera.fy, camera.fy**2]
    w[layout.INFO_STEP], w[layout.FLOOR] = 3.0, 0.0
    return w


def put_pose(w: np.ndarray, pose: Pose, place: int = POSE) -> None:
    """Write a pose of the object, for its points about the centroid over their size."""
    centre = w[layout.CENTRE : layout.CENTRE + 3]
    w[place : place + 9] = pose.R.ravel()
    w[place + 9 : place + 12] = (pose.t + pose.R @ centre) / w[layout.SIZE]


def get_pose(w: np.ndarray, place: int = POSE) -> Pose:
    """The pose of the object in its own frame and unit."""
    R = w[place : place + 9].reshape(3, 3).copy()
    centre = w[layout.CENTRE : layout.CENTRE + 3]
    return Pose(R, w[layout.SIZE] * w[place + 9 : place + 12] - R @ centre)
