"""Starts for the refinement: centred EPOSIT, the poses of a triangle, and the planar start with its mirror twin.

Arrays have the problems last: rays (n, 3, b), poses R (3, 3, b) and t (3, b).
"""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array, take_last
from eposit.pose import PoseBatch
from eposit.posit.iteration import posit
from eposit.posit.orthography import Orthography
from eposit.rays import centred_image
from eposit.shape import Shape
from eposit.starts.homography import homography_start, mirror_twin
from eposit.starts.p3p import p3p_poses

START_TOL = 1e-3  # a start needs no more
START_ITERATIONS = 50  # the median is 7; what takes longer has usually lost its way
TRIANGLE_POSES = 2  # a triangle has up to four poses; under noise the right one is among the best two
BOARD_RATIO = 0.02  # the same ratio, below which EPOSIT takes hundreds of iterations and is left out
FLAT_RATIO = 0.2  # least over second spread of an object below which the planar start is tried


def centred_start(shape: Shape, rays: Array) -> PoseBatch | None:
    """Centred EPOSIT; None for an object on which it is slow at best."""
    if not (shape.solid and shape.flatness > BOARD_RATIO):
        return None
    image, back = centred_image(rays)
    return turn_back(back, posit(Orthography.of(shape.points_in_obj, image), START_TOL, START_ITERATIONS))


def other_starts(shape: Shape, rays: Array) -> list[PoseBatch]:
    """Rough poses, one of which lies in the basin of the best pose where centred EPOSIT misses it.

    EPOSIT's iteration diverges, or settles beside the truth, for about one in a hundred random objects; the poses of
    a triangle hold the rest. Many points in or near a plane, on which EPOSIT is slow at best, need a start that uses
    all of them, and its twin.
    """
    found = [_poses(*pose) for pose in p3p_poses(shape.points_in_obj, rays, TRIANGLE_POSES)]
    if shape.flatness < FLAT_RATIO:
        found += _planar(shape.points_in_obj, rays)
    return found


def turn_back(back: Array, start: PoseBatch) -> PoseBatch:
    """The poses of `start` with the camera frame turned by `back`, (3, 3, b)."""
    R, t = np.einsum("ikb,kjb->ijb", back, start.R), np.einsum("ikb,kb->ib", back, start.t)
    return PoseBatch(R, t, start.iterations, start.converged)


def _planar(points_in_obj: Array, rays: Array) -> list[PoseBatch]:
    """The pose by homography and its twin."""
    usable = np.flatnonzero(np.all(np.isfinite(rays), axis=(0, 1)))
    if not len(usable):
        return []
    R, t = homography_start(points_in_obj, take_last(rays, usable).transpose(2, 0, 1))
    found: list[PoseBatch] = []
    for R_some, t_some in ((R, t), mirror_twin(points_in_obj, R, t)):
        start = _poses(np.full((3, 3, rays.shape[-1]), np.nan), np.full((3, rays.shape[-1]), np.nan))
        start.R[..., usable], start.t[:, usable] = R_some.transpose(1, 2, 0), t_some.T
        start.converged[usable] = True
        found.append(start)
    return found


def _poses(R: Array, t: Array) -> PoseBatch:
    return PoseBatch(R, t, np.zeros(t.shape[1], np.int64), np.all(np.isfinite(t), axis=0))
