"""Starts for the refinement: centred EPOSIT, the poses of a triangle, and the planar start with its mirror twin."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from eposit.camera import Camera
from eposit.p3p import p3p_starts
from eposit.planar import homography_start, mirror_twin, plane_axes
from eposit.posit import COPLANAR_CONDITION, Start, centring_rotations, condition, posit, rectify_bearings

START_TOL = 1e-3  # a start needs no more
START_ITERATIONS = 50  # the median is 7; what takes longer has usually lost its way
TRIANGLE_POSES = 2  # a triangle has up to four poses; under noise the right one is among the best two
BOARD_RATIO = 0.02  # the same ratio, below which EPOSIT takes hundreds of iterations and is left out
FLAT_RATIO = 0.2  # least over second spread of an object below which the planar start is tried
RIM_ALLOWANCE = 0.01  # image points this fraction outside the lens's image circle are noise, not errors


def centred_points(bearings: Array) -> tuple[Array, Array, Array]:
    """Pinhole points x, y, (n, b), about M0's ray, and the rotations (b, 3, 3) that turn results back."""
    turn = centring_rotations(bearings)
    turned = bearings @ np.swapaxes(turn, 1, 2)
    turned[:, 0] = (0.0, 0.0, 1.0)  # M0 by construction; rounding would leave 1e-16
    x, y = rectify_bearings(turned)
    return x, y, np.swapaxes(turn, 1, 2)


def turn_back(back: Array, start: Start) -> Start:
    """The poses of `start` with the camera frame turned by `back`."""
    return Start(back @ start.R, (back @ start.t[..., None])[..., 0], start.iterations, start.converged)


def starts(points_in_obj: Array, bearings: Array) -> list[Start]:
    """Rough poses, one of which lies in the basin of the best pose; empty if the points cannot give any.

    EPOSIT's iteration diverges, or settles beside the truth, for about one in a hundred random objects; the poses of
    a triangle hold the rest. Many points in or near a plane, on which EPOSIT is slow at best, need a start that uses
    all of them, and its twin.
    """
    _, _, spreads = plane_axes(points_in_obj)
    solid = condition(points_in_obj) <= COPLANAR_CONDITION
    many = len(points_in_obj) > 4
    if spreads[1] <= spreads[0] / COPLANAR_CONDITION or not (solid or many):
        return []
    found = [_poses(*pose) for pose in p3p_starts(points_in_obj, bearings, TRIANGLE_POSES)]
    flatness = spreads[2] / spreads[1] if many else np.inf
    if solid and flatness > BOARD_RATIO:
        x, y, back = centred_points(bearings)
        found.insert(0, turn_back(back, posit(points_in_obj, x, y, START_TOL, START_ITERATIONS)))
    if flatness < FLAT_RATIO:
        planar = _planar(points_in_obj, bearings)
        found += [planar, _poses(*mirror_twin(points_in_obj, planar.R, planar.t))]
    return found


def rim_bearings(camera: Camera, points_px: Array) -> Array:
    """Bearings with points just outside the image circle drawn onto it: near 90 degrees noise alone moves them out."""
    law = camera.law
    if not np.isfinite(law.rho_max):
        return camera.bearing(points_px)
    centre, focal = np.array([camera.cx, camera.cy]), np.array([camera.fx, camera.fy])
    normalised = (points_px - centre) / focal
    excess = np.hypot(normalised[..., 0], normalised[..., 1]) / law.rho_max
    pull = np.where((excess > 1.0) & (excess <= 1.0 + RIM_ALLOWANCE), (1.0 - 1e-12) / np.maximum(excess, 1.0), 1.0)
    return camera.bearing(centre + normalised * pull[..., None] * focal)


def _planar(points_in_obj: Array, bearings: Array) -> Start:
    usable = np.all(np.isfinite(bearings), axis=(1, 2))
    R, t = np.full((len(bearings), 3, 3), np.nan), np.full((len(bearings), 3), np.nan)
    if np.any(usable):
        R[usable], t[usable] = homography_start(points_in_obj, bearings[usable])
    return _poses(R, t)


def _poses(R: Array, t: Array) -> Start:
    return Start(R, t, np.zeros(len(t), np.int64), np.all(np.isfinite(t), axis=1))
