"""POSIT, EPOSIT and centred EPOSIT as methods of their own: the iteration, and a check of what it ends in."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array, Mask, take_last
from eposit.pose import PoseBatch
from eposit.posit.iteration import posit
from eposit.posit.newton import CONTRACTS
from eposit.posit.orthography import Orthography
from eposit.shape import Shape
from eposit.starts.p3p import p3p_poses

CONVERGENT_TAN = np.sqrt(2.0)  # tan of the incidence angle beyond which the iteration no longer contracts
DOUBTFUL_MISFIT = 1e-3  # misfit over spread above which a fixed point is compared with the poses of a triangle
CONSISTENT_MISFIT = 0.1  # misfit over spread above which a fixed point is no pose
QUICK = 40  # iterations to a relative change of 1e-12: half of it in each step
EXACT_MISFIT = 1e-7  # misfit over spread of a triangle's pose that shows noise-free points, which EPOSIT then must fit


def posit_checked(shape: Shape, image: Array, tol: float, max_iterations: int) -> tuple[PoseBatch, Mask, Array]:
    """`posit`, retried inside its limit; a (b,) mask of the poses that reproduce their points; how well they do.

    The last is (2, b), the sums of the squared distances in x and in y between reprojections and pinhole points.

    The fixed point that the iteration finds need not be the pose (about one random object in a thousand), and a pose
    need not attract it. A misfit of a tenth of the points' spread tells, and for noise-free points the poses of a
    triangle do: one of them fits exactly. From it the same equations are iterated again with half steps, provided
    that all points lie below atan(sqrt 2). Under noise a flat object's misfit is large and no reason to reject. The
    triangle is left out where the iteration has one fixed point, and where the pose is sure to be the only one so
    faithful.
    """
    points_in_obj = shape.points_in_obj
    system = Orthography.of(points_in_obj, image)
    start = posit(system, tol, max_iterations)
    squares, spread = _squares(points_in_obj, image, start.R, start.t)
    misfit = _rms(squares, points_in_obj)
    limit = CONSISTENT_MISFIT * spread
    trusted = (misfit <= DOUBTFUL_MISFIT * spread) | (system.contraction <= CONTRACTS)
    if not np.all(trusted):
        quick = start.iterations <= QUICK  # the iteration contracts well: no second fixed point is near
        trusted |= quick & shape.sure(start.R, start.t, len(points_in_obj) * misfit**2)
    doubtful = np.flatnonzero(~trusted & np.isfinite(spread))
    if not len(doubtful):
        return start, misfit <= limit, squares
    some = take_last(image, doubtful)
    rays = np.stack((some[0], some[1], np.ones_like(some[0])), axis=1)
    ((R, t),) = p3p_poses(points_in_obj, rays / np.sqrt(np.einsum("nib,nib->nb", rays, rays))[:, None], 1)
    exact = _rms(_squares(points_in_obj, some, R, t)[0], points_in_obj) <= EXACT_MISFIT * spread[doubtful]
    limit[doubtful[exact]] = DOUBTFUL_MISFIT * spread[doubtful[exact]]
    inside = np.all(np.hypot(some[0], some[1]) < CONVERGENT_TAN, axis=0) & (t[2] > 0.0)
    again = np.flatnonzero(~(misfit[doubtful] <= limit[doubtful]) & inside)
    if len(again):
        forward = R[2][:, again]
        k = forward * (system.reach / (t[2, again] + points_in_obj[0] @ forward))
        rows = doubtful[again]
        start.put(rows, posit(system.take(rows), tol, max_iterations, k, 0.5))
        squares[:, rows], _ = _squares(
            points_in_obj, take_last(image, rows), take_last(start.R, rows), take_last(start.t, rows)
        )
        misfit[rows] = _rms(squares[:, rows], points_in_obj)
    return start, misfit <= limit, squares


def _squares(points_in_obj: Array, image: Array, R: Array, t: Array) -> tuple[Array, Array]:
    """Sums of the squared distances in x and y of reprojections from the pinhole points, (2, b), NaN behind the camera,
    and the RMS spread of those, (b,)."""
    with np.errstate(all="ignore"):
        point = np.einsum("nj,ijb->inb", points_in_obj, R)
        point += t[:, None]
        miss = point[:2] / point[2]
        miss -= image
        squares = np.einsum("anb,anb->ab", miss, miss)
        apart = image - np.add.reduce(image, axis=1, keepdims=True) / len(points_in_obj)
        spread = np.sqrt(np.einsum("anb,anb->b", apart, apart) / len(points_in_obj))
        if not np.all(point[2] > 0.0):
            squares[:, ~np.all(point[2] > 0.0, axis=0)] = np.nan
        return squares, spread


def _rms(squares: Array, points_in_obj: Array) -> Array:
    return np.sqrt((squares[0] + squares[1]) / len(points_in_obj))
