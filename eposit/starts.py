"""Starts for the refinement: centred EPOSIT, the poses of a triangle, and the planar start with its mirror twin.

Arrays have the problems last: rays (n, 3, b), poses R (3, 3, b) and t (3, b).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from eposit.arrays import Array, Mask, pick
from eposit.orthography import Orthography
from eposit.p3p import p3p_poses
from eposit.planar import homography_start, mirror_twin, plane_axes
from eposit.posit import Start, posit
from eposit.rectify import centred_image

COPLANAR_CONDITION = 1e4  # cond(A) from which the points count as coplanar: there double precision leaves 12 digits
START_TOL = 1e-3  # a start needs no more
START_ITERATIONS = 50  # the median is 7; what takes longer has usually lost its way
TRIANGLE_POSES = 2  # a triangle has up to four poses; under noise the right one is among the best two
BOARD_RATIO = 0.02  # the same ratio, below which EPOSIT takes hundreds of iterations and is left out
FLAT_RATIO = 0.2  # least over second spread of an object below which the planar start is tried
NARROW = 0.5  # reach^2 over thickness and distance below which an object is seen nearly in parallel
FAITHFUL = 0.1  # misfit over angular thickness below which a narrow object has one pose


@dataclass(frozen=True, slots=True)
class Shape:
    """What an object's points allow."""

    points_in_obj: Array  # (n, 3)
    reach: float  # largest distance from M0
    thickness: float  # least singular value of the offsets from M0: 0 for coplanar points
    solid: bool  # whether the linear methods have equations for it
    line: bool  # whether the points lie on a line
    flatness: float  # least over second spread; infinite for four points, which the planar start does not help

    @staticmethod
    def of(points_in_obj: Array) -> Shape:
        """The shape of (n, 3) points."""
        offsets = points_in_obj[1:] - points_in_obj[0]
        values = np.linalg.svd(offsets, compute_uv=False)
        _, _, spreads = plane_axes(points_in_obj)
        return Shape(
            points_in_obj=points_in_obj,
            reach=float(np.sqrt(np.max(np.sum(offsets**2, axis=1)))),
            thickness=float(values[-1]),
            solid=bool(values[0] <= COPLANAR_CONDITION * values[-1] and values[-1] > 0.0),
            line=bool(spreads[1] <= spreads[0] / COPLANAR_CONDITION),
            flatness=float(spreads[2] / spreads[1]) if len(points_in_obj) > 4 and spreads[1] > 0.0 else np.inf,
        )

    @property
    def usable(self) -> bool:
        """Whether the points can give a pose: four must not be coplanar, more must not be on a line."""
        return not self.line and (self.solid or len(self.points_in_obj) > 4)

    def sure(self, R: Array, t: Array, misfit: Array) -> Mask:
        """(b,) mask of poses so faithful that no other pose can be: false where that is not certain.

        misfit: (b,) sums over the points of the squared distance between image and reprojection, rad^2 or more.

        Let two poses show an object's offsets A with misfits whose sum is e, at depth d. In POSIT's equations
        A (I - I') = (1 + eps) x - (1 + eps') x' each image moves by e, and eps by the change of k at most, which the
        image of an object of the angular size reach / d weighs little. If reach^2 / (thickness d) is well below 1, then
        |I - I'| d <= 2 e d / thickness: both lie in one basin. The two constants keep the product of both bounds far
        from 1. Of 1 040 000 random problems, exact and noisy, up to 60 per cent deep, 238 000 were sure and all right;
        of 1700 that centred EPOSIT alone got wrong, the narrow ones had 3 times this misfit, the faithful ones were 1.8
        times as wide.
        """
        first = np.einsum("ijb,j->ib", R, self.points_in_obj[0]) + t
        distance = np.sqrt(np.einsum("ib,ib->b", first, first))
        narrow = self.reach**2 <= NARROW * self.thickness * distance
        return narrow & (misfit * distance**2 <= (FAITHFUL * self.thickness) ** 2)


def centred_start(shape: Shape, rays: Array) -> Start | None:
    """Centred EPOSIT; None for an object on which it is slow at best."""
    if not (shape.solid and shape.flatness > BOARD_RATIO):
        return None
    image, back = centred_image(rays)
    return turn_back(back, posit(Orthography.of(shape.points_in_obj, image), START_TOL, START_ITERATIONS))


def other_starts(shape: Shape, rays: Array) -> list[Start]:
    """Rough poses, one of which lies in the basin of the best pose where centred EPOSIT misses it.

    EPOSIT's iteration diverges, or settles beside the truth, for about one in a hundred random objects; the poses of
    a triangle hold the rest. Many points in or near a plane, on which EPOSIT is slow at best, need a start that uses
    all of them, and its twin.
    """
    found = [_poses(*pose) for pose in p3p_poses(shape.points_in_obj, rays, TRIANGLE_POSES)]
    if shape.flatness < FLAT_RATIO:
        found += _planar(shape.points_in_obj, rays)
    return found


def turn_back(back: Array, start: Start) -> Start:
    """The poses of `start` with the camera frame turned by `back`, (3, 3, b)."""
    R, t = np.einsum("ikb,kjb->ijb", back, start.R), np.einsum("ikb,kb->ib", back, start.t)
    return Start(R, t, start.iterations, start.converged)


def _planar(points_in_obj: Array, rays: Array) -> list[Start]:
    """The pose by homography and its twin."""
    usable = np.flatnonzero(np.all(np.isfinite(rays), axis=(0, 1)))
    if not len(usable):
        return []
    R, t = homography_start(points_in_obj, pick(rays, usable).transpose(2, 0, 1))
    found: list[Start] = []
    for R_some, t_some in ((R, t), mirror_twin(points_in_obj, R, t)):
        start = _poses(np.full((3, 3, rays.shape[-1]), np.nan), np.full((3, rays.shape[-1]), np.nan))
        start.R[..., usable], start.t[:, usable] = R_some.transpose(1, 2, 0), t_some.T
        start.converged[usable] = True
        found.append(start)
    return found


def _poses(R: Array, t: Array) -> Start:
    return Start(R, t, np.zeros(t.shape[1], np.int64), np.all(np.isfinite(t), axis=0))
