"""GPnPf: pose and focal length of a pinhole camera from four or more points."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import ArrayLike, NDArray

from eposit.arrays import Array, Mask
from eposit.camera import Camera
from eposit.gpnpf.polynomials import SOLUTIONS, System, depth_ratios, squared_focal
from eposit.least_squares import damped_gauss_newton
from eposit.pose import Pose
from eposit.solution import Status
from eposit.unknown_camera import CameraCandidates, Estimate, choose, in_chunks, read, reprojection_squares, table

REAL_IMAGINARY = 1e-4  # |Im s| / |s| up to which a root counts as real: rounding parts a double root by about 1e-7
START_IMAGINARY = 1.0  # the same for a start of the least squares of five and more points: every root
STEPS = 200  # of Gauss-Newton at most: four points need 1 to 3; see `solve` for more points
COLLINEAR = 1e-4  # second over first spread of an object below which there is no pose


@np.errstate(all="ignore")  # of sizes whose squares no number holds there is no solution
def solve(
    points_in_obj: ArrayLike, points_px: ArrayLike, camera: Camera, *, sigma_px: ArrayLike | None = None
) -> Estimate:
    """Pose and focal length of a pinhole camera, for one image or a batch.

    points_in_obj: (n, 3), n >= 4, any length unit. points_px: (n, 2) or (b, n, 2), px, pixel centres at integers.
    camera: its principal point and its aspect fy / fx are used. Its focal length is estimated; its lens is not used.
    sigma_px: as in `eposit.solve`; checked, but the equations have no weights.

    Rule: of the solutions with F = f^2 > 0 and every depth positive, the one of lowest reprojection error. Four points
    give 8 equations for 7 unknowns, and the system of ten solutions leaves one of them, the distance of the last two
    points, for this choice. From five points on, the sum of squares of the polynomials is brought to local minima from
    the solutions of four well-spread points; the rule is the same. Some minima are reached slowly: where 200 steps are
    not enough for the chosen solution (0.4 px and 5, 8 points: 25, 13 images in 1000) the status is NOT_CONVERGED.

    Returns:
        Estimate: a Solution with `.camera` (a Division with k = 0) and `.candidates`, in the order of rising s. A
        batch gives the same as single calls to 1e-12.
    Raises:
        ValueError: wrong shapes, fewer than four points, non-finite object points, or a wrong sigma.
    Source:
        Zheng, Sugimoto, Sato, Okutomi 2014, see `gpnpf_roots`.
    """
    images = read(points_in_obj, points_px, camera, sigma_px)
    spreads = np.linalg.svd(images.points_in_obj - images.points_in_obj.mean(axis=0), compute_uv=False)
    unusable = Status.COPLANAR if spreads[1] <= COLLINEAR * spreads[0] else None
    found = in_chunks(images, partial(_candidates, images.points_in_obj))
    with np.errstate(invalid="ignore"):
        in_front = np.all(found.poses.apply(images.points_in_obj)[..., 2] > 0.0, axis=-1)
    cost = np.where(in_front, reprojection_squares(images, found), np.nan)
    return choose(images, replace(found, cost=cost), cost, unusable)


def _candidates(points_in_obj: Array, offsets: Array) -> CameraCandidates:
    """Real solutions with F > 0 of (b, n, 2) offsets from the principal point."""
    order = _edge_first(points_in_obj)
    obj, pixels = points_in_obj[order], offsets[:, order]
    scale = np.max(np.abs(pixels - pixels[:, :1]), axis=(1, 2))
    edge = obj[1] - obj[0]
    with np.errstate(all="ignore"):  # points that coincide, or whose squares no number holds, give no root
        length2 = edge @ edge
        along, reach = (obj[2:] - obj[0]) @ edge / length2, np.sum((obj[2:] - obj[0]) ** 2, axis=1) / length2
    scale = np.where(scale > 0.0, scale, 1.0)
    system = System(np.ascontiguousarray((pixels / scale[:, None, None]).transpose(2, 1, 0)), along, reach)
    roots = depth_ratios(system)
    limit = REAL_IMAGINARY if len(obj) == 4 else START_IMAGINARY
    with np.errstate(invalid="ignore"):
        real = (roots.imag >= 0.0) & (roots.imag <= limit * np.abs(roots))
    which, image = np.nonzero(real)
    in_order = np.lexsort((roots.real[which, image], image))
    which, image = which[in_order], image[in_order]
    rows = system.take(image)
    s = roots.real[which, image]
    minima = damped_gauss_newton(partial(_model, rows), np.stack((s, squared_focal(rows, s))), STEPS)
    s, F = minima.x
    with np.errstate(invalid="ignore"):
        keep = np.isfinite(s) & (F > 0.0) & (F < 1e12)
    image, f = image[keep], np.sqrt(F[keep])
    pose, sound = _poses(obj, rows.take(np.flatnonzero(keep)), s[keep], f)
    f_px, pose = (f * scale[image])[sound], Pose(pose.R[sound], pose.t[sound])
    return table(SOLUTIONS, image[sound], len(offsets), pose, f_px, 0.0 * f_px, minima.take(keep).take(sound))


def _edge_first(points_in_obj: Array) -> NDArray[np.int64]:
    """The longest edge's ends, the point farthest from it, the one farthest from their plane, then the rest."""
    gaps = np.linalg.norm(points_in_obj[:, None] - points_in_obj[None], axis=-1)
    chosen = [int(index) for index in np.unravel_index(np.argmax(gaps), gaps.shape)]
    while len(chosen) < 4:
        spanned = points_in_obj[chosen[1:]] - points_in_obj[chosen[0]]
        rest = points_in_obj - points_in_obj[chosen[0]]
        rest = rest - rest @ np.linalg.pinv(spanned, rcond=1e-9) @ spanned
        apart = np.linalg.norm(rest, axis=1)
        if np.max(apart) < 1e-3 * np.max(gaps):  # in the plane: the point farthest from the others
            apart = np.min(gaps[chosen], axis=0)
        apart[chosen] = -1.0
        chosen.append(int(np.argmax(apart)))
    return np.array(chosen + [i for i in range(len(points_in_obj)) if i not in chosen])


def _model(system: System, unknowns: Array, rows: NDArray[np.int64]) -> tuple[Array, Array]:
    """Values of the polynomials, (n - 2, m), and their slopes by s and F, (n - 2, 2, m), at s and F, (2, m).

    The slope along s is a complex step, which for polynomials is exact.
    """
    s, focal2 = unknowns
    system = system if len(rows) == system.w.shape[-1] else system.take(rows)
    stepped = system.values(s + 1e-30j, focal2)
    slopes = np.stack((np.imag(stepped) / 1e-30, system.slope_in_focal2(s, focal2)), axis=1)
    return np.real(stepped), slopes


def _poses(points_in_obj: Array, system: System, s: Array, f: Array) -> tuple[Pose, Mask]:
    """R (m, 3, 3), t (m, 3) of the similarity that carries the object onto the points along the rays, and a mask."""
    ex, ey = system.edge(s)
    e2 = ex * ex + ey * ey + 4.0 * s * s * f * f
    depths = [1.0 - s, 1.0 + s]
    with np.errstate(all="ignore"):
        for i, along in enumerate(system.along):
            x, y = system.w[:, i + 2]
            gap_x, gap_y = system.w[:, i + 2] - system.w[:, 0]
            M = along * e2 - (1.0 - s) * (gap_x * ex + gap_y * ey)
            depths.append(1.0 - s + M / (x * ex + y * ey + 2.0 * s * f * f))
    lam = np.stack(depths, axis=-1)  # (m, n)
    sound = np.all(np.isfinite(lam), axis=1)
    lam = np.where(sound[:, None], lam, 1.0)
    points = np.stack((lam * system.w[0].T, lam * system.w[1].T, lam * f[:, None]), axis=-1)
    middle, centroid = points.mean(axis=1), points_in_obj.mean(axis=0)
    left, sizes, right = np.linalg.svd(np.swapaxes(points - middle[:, None], 1, 2) @ (points_in_obj - centroid))
    sign = np.sign(np.linalg.det(left @ right))
    left[:, :, 2] *= sign[:, None]
    R = left @ right
    scale = (sizes[:, 0] + sizes[:, 1] + sign * sizes[:, 2]) / np.sum((points_in_obj - centroid) ** 2)
    return Pose(R, middle / scale[:, None] - R @ centroid), sound & (scale > 0.0)
