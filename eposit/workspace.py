"""Memory of the compiled solvers: workspaces, which are used again, and where a call finds the arrays it reads.

A single pose takes a compiled solver a few microseconds. NumPy needs as long to make an array, and longer to tell where
its numbers are, so that both are done once, and not in each call.
"""

from __future__ import annotations

import functools

import numpy as np

from eposit.arrays import Array
from eposit.camera import BEARINGS, Camera
from eposit.compiled import layout

LENS_KINDS = {
    "perspective": layout.PERSPECTIVE,
    "stereographic": layout.STEREOGRAPHIC,
    "equidistance": layout.POLYNOMIAL,
    "equisolid": layout.EQUISOLID,
    "orthogonal": layout.ORTHOGONAL,
    "kannala_brandt": layout.POLYNOMIAL,
    "pinhole_radial": layout.PINHOLE_RADIAL,
    "eucm": layout.EUCM,
    "double_sphere": layout.DOUBLE_SPHERE,
}
BEYOND = 0.1  # by which the cosine of a point may be below that of the lens's largest angle: noise at the rim
LARGEST_COPY = 1024  # numbers whose copy is quicker than asking where they are
LARGEST_KEPT = 1024  # points of a workspace that is kept: 0.2 MB
MOST_KEPT = 8  # more calls at once make workspaces of their own


class Workspace:
    """The array `w` of `layout` for up to `room` points, and room for the results of one image."""

    __slots__ = ("address", "camera", "numbers", "result", "result_address", "room")

    def __init__(self, room: int) -> None:
        self.room = room
        self.camera: Camera | None = None
        self.numbers = np.empty(layout.POINTS + layout.PER_POINT * room)
        self.result = np.empty(layout.RESULT)
        self.address, self.result_address = self.numbers.ctypes.data, self.result.ctypes.data

    def write(self, camera: Camera) -> None:
        """Make it one of this camera; all else is written by the solvers."""
        if self.camera is camera:
            return
        header = _header(camera)
        self.numbers[: len(header)] = header
        self.numbers[layout.ANGULAR] = 1.0 if camera is BEARINGS else 0.0
        self.camera = camera


_free: list[Workspace] = []


def lend(camera: Camera, n: int) -> Workspace:
    """A workspace for n points that nobody else has, with the camera written; to be given back."""
    try:
        found = _free.pop()  # one step, so that no two threads have the same
    except IndexError:
        found = Workspace(n)
    if found.room < n:
        found = Workspace(n)
    found.write(camera)
    return found


def give_back(workspace: Workspace) -> None:
    """After the call: it may be lent again."""
    if workspace.room <= LARGEST_KEPT and len(_free) < MOST_KEPT:
        _free.append(workspace)


def readable(values: Array) -> bytes | int:
    """What a compiled function is given for a contiguous array that it reads: a copy if it is small, else its address.

    An address holds as long as the array.
    """
    return values.tobytes() if values.size <= LARGEST_COPY else values.ctypes.data


@functools.lru_cache(maxsize=256)
def _header(camera: Camera) -> Array:
    """The workspace up to the intrinsics."""
    law, coefficients = camera.law, (*camera.coefficients, 0.0, 0.0, 0.0, 0.0)[:4]
    least = np.cos(law.theta_max) - BEYOND
    numbers = (LENS_KINDS[camera.lens], law.theta_max, law.rho_max, least, *coefficients)
    return np.array((*numbers, camera.fx, camera.fy, camera.cx, camera.cy))
