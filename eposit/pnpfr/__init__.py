"""PnPfr: pose, focal length and radial distortion (one-parameter division model) from four non-coplanar points."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask
from eposit.camera import Camera
from eposit.least_squares import Minima, damped_gauss_newton
from eposit.pnpfr.polynomials import SOLUTIONS, Complex, dual_basis, solve_roots
from eposit.pose import Pose, rotation_from_vector
from eposit.shape import Shape
from eposit.solution import Status
from eposit.unknown_camera import CameraCandidates, Estimate, choose, in_chunks, read, reprojection_squares, table

REAL_IMAGINARY = 1e-4  # largest imaginary part of the relative depths and of k up to which a root counts as real
STEPS = 6  # of the least squares at most; half need 2, 99 in 100 up to 5
AXIS = 1e-4  # least distance from the principal point, relative to the farthest, before the least squares
ORTHOGONAL = 1e-6  # deviation from a rotation above which the least squares have not arrived
REPRODUCED_PX2 = 1e-6  # sum of squares above which a root is none: true ones leave rounding, below 1e-12
ASKEW = (0.7, -1.1, 0.4)  # rotation vector that turns the object's axes away from those of its points; any will do


@np.errstate(all="ignore")  # of sizes whose squares no number holds there is no solution
def solve(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, *, sigma_px: ArrayLike | None = None
) -> Estimate:
    """Pose, focal length and division-model distortion of a camera, for one image or a batch.

    points_in_obj: (4, 3), any length unit, not coplanar. points_px: (4, 2) or (b, 4, 2), px, pixel centres at integers.
    camera: its principal point and its aspect fy / fx are used. Its focal length and its distortion are estimated; its
        lens is not used.
    sigma_px: as in `eposit.solve`; checked, but the equations have no weights.

    Rule: 8 equations for 8 unknowns, so every real solution reproduces the image points and no error tells them apart.
    Of those whose depths are all positive and whose distortion keeps every image point on the branch of the model that
    starts on the axis (k r^2 < 1), the one of least distortion |k|.

    Returns:
        Estimate: a Solution with `.camera` (a Division) and `.candidates`, ordered by the real part of the eigenvalue
        (the direction of the optical axis in stereographic projection). A batch gives the same as single calls to
        1e-12. Coplanar points give Status.COPLANAR.
    Raises:
        ValueError: wrong shapes, not four points, non-finite object points, or a wrong sigma.
    Source:
        Larsson, Kukelova, Zheng 2017, the non-planar P4Pfr, see `pnpfr_roots`.
    """
    images = read(points_in_obj, points_px, camera, sigma_px)
    if len(images.points_in_obj) != 4:
        raise ValueError(f"points_in_obj has {len(images.points_in_obj)} points; PnPfr takes exactly 4, choose four")
    if not Shape.of(images.points_in_obj).solid:
        found = in_chunks(images, _nothing)
        return choose(images, found, found.cost, Status.COPLANAR)
    found = in_chunks(images, partial(_candidates, images.points_in_obj))
    cost = reprojection_squares(images, found)
    with np.errstate(invalid="ignore"):
        cost = np.where(cost < REPRODUCED_PX2, cost, np.nan)
    found = replace(found, cost=cost, converged=np.isfinite(cost))  # a step relative to k says nothing where k = 0
    return choose(images, found, np.where(np.isnan(cost), np.nan, np.abs(found.k_per_px2)))


def _nothing(offsets: Array) -> CameraCandidates:
    rows, none = np.zeros(0, np.int64), np.zeros(0)
    minima = Minima(np.zeros((5, 0)), rows, np.zeros(0, bool))
    return table(SOLUTIONS, rows, len(offsets), Pose(np.zeros((0, 3, 3)), np.zeros((0, 3))), none, none, minima)


def _candidates(points_in_obj: Array, offsets: Array) -> CameraCandidates:
    """Real solutions of (b, 4, 2) offsets from the principal point."""
    size = np.sqrt(np.mean(np.sum((points_in_obj - points_in_obj[0]) ** 2, axis=1)))
    if not 0.0 < size < np.inf:  # no number holds the squares
        return _nothing(offsets)
    askew = rotation_from_vector(ASKEW)
    obj = (points_in_obj - points_in_obj[0]) @ askew.T / size
    w = (offsets[..., 0] + 1j * offsets[..., 1]).T
    scale = np.max(np.abs(w), axis=0)
    w = w / np.where(scale > 0.0, scale, 1.0)
    roots = solve_roots(obj, np.where(np.abs(w) < AXIS, AXIS, w))  # on the principal point a ray has no azimuth
    with np.errstate(all="ignore"):
        largest = np.argmax(np.abs(roots.depths), axis=0)
        depths = roots.depths / np.take_along_axis(roots.depths, largest[None], axis=0)
        imaginary = np.max(np.abs(depths.imag), axis=0) + np.abs(roots.k.imag) / (1.0 + np.abs(roots.k))
        which, image = np.nonzero(~roots.spurious & (imaginary < REAL_IMAGINARY))
    order = np.lexsort((roots.axis.real[which, image], image))
    which, image = which[order], image[order]
    dual, seen = dual_basis(obj), w[:, image].T
    unknowns = np.concatenate((depths.real[:, which, image], roots.k.real[None, which, image]))
    minima = damped_gauss_newton(partial(_model, dual, seen), unknowns, STEPS)
    k = minima.x[4]
    pose, f, sound = _poses(dual, seen, minima.x[:4].T, k)
    t = pose.t * size - (pose.R @ askew) @ points_in_obj[0]
    rows, pose = image[sound], Pose((pose.R @ askew)[sound], t[sound])
    f_px, k_per_px2 = f[sound] * scale[rows], k[sound] / scale[rows] ** 2
    return table(SOLUTIONS, rows, len(offsets), pose, f_px, k_per_px2, minima.take(sound))


def _rows(dual: Array, w: Complex, depths: Array, k: Array) -> tuple[Array, Array, Array]:
    """p1, p2, p3, each (m, 3), of the camera."""
    bent = 1.0 + k[:, None] * np.abs(w) ** 2
    return (w.real * depths) @ dual, (w.imag * depths) @ dual, (bent * depths) @ dual


def _model(dual: Array, all_w: Complex, unknowns: Array, rows: NDArray[np.int64]) -> tuple[Array, Array]:
    """|p1| = |p2| and p1 . p2 = p1 . p3 = p2 . p3 = 0 in the depths and k, (5, m): what they miss, and their slopes.

    All four hold for any common factor of the depths. A fifth equation without a residual keeps steps from changing it.
    """
    depths, k, w = unknowns[:4].T, unknowns[4], all_w[rows]
    u, v, r2 = w.real, w.imag, np.abs(w) ** 2
    p1, p2, p3 = _rows(dual, w, depths, k)
    y1, y2, y3, bent = p1 @ dual.T, p2 @ dual.T, p3 @ dual.T, 1.0 + k[:, None] * r2
    by_k = (r2 * depths) @ dual
    miss = np.stack((_inner(p1, p1) - _inner(p2, p2), 2.0 * _inner(p1, p2), _inner(p1, p3), _inner(p2, p3), 0.0 * k))
    slope = np.zeros((5, 5, len(k)))
    slope[0, :4], slope[1, :4] = 2.0 * (y1 * u - y2 * v).T, 2.0 * (y1 * v + y2 * u).T
    slope[2, :4], slope[3, :4] = (y3 * u + y1 * bent).T, (y3 * v + y2 * bent).T
    slope[2, 4], slope[3, 4], slope[4, :4] = _inner(p1, by_k), _inner(p2, by_k), depths.T
    return miss, slope


def _poses(dual: Array, w: Complex, depths: Array, k: Array) -> tuple[Pose, Array, Mask]:
    """Poses of an object whose first point is the origin, focal lengths (m,), and a mask of those that are solutions.

    The sign of the camera matrix follows from the handedness of its rows; with it f is positive.
    """
    p1, p2, p3 = _rows(dual, w, depths, k)
    with np.errstate(all="ignore"):
        third = np.cross(p1, p2)
        sign = np.sign(_inner(third, p3))[:, None]
        size1, size3 = np.sqrt(0.5 * (_inner(p1, p1) + _inner(p2, p2))), np.sqrt(_inner(p3, p3))
        f = size1 / size3
        i, j = sign * p1 / size1[:, None], sign * p2 / size1[:, None]
        R = np.stack((i, j, np.cross(i, j)), axis=1)
        first = np.stack((w[:, 0].real / f, w[:, 0].imag / f, 1.0 + k * np.abs(w[:, 0]) ** 2), axis=-1)
        t = first * (sign[:, 0] * depths[:, 0] / size3)[:, None]
        skew = np.max(np.abs(R @ np.swapaxes(R, 1, 2) - np.eye(3)), axis=(1, 2))
        sound = np.all(np.isfinite(t), axis=1) & (sign[:, 0] != 0.0) & (f > 0.0) & (skew < ORTHOGONAL)
    return Pose(R, t), f, sound


def _inner(a: Array, b: Array) -> Array:
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]
