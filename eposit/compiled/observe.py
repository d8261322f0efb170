"""One image as the compiled solvers see it, the weights of its points, and poses in the object's own frame."""

from __future__ import annotations

import math

from eposit.compiled.kernel import NOTHING, NUMBER, POINTER, WHOLE, W, compiled, part
from eposit.compiled.layout import (
    ANGULAR,
    CENTRE,
    FLOOR,
    INFO,
    INFO_STEP,
    INTRINSICS,
    LENS,
    MINIMA,
    POINTS,
    POSE,
    RAYS,
    SEEN,
    SIZE,
    WEIGHTS,
)  # fmt: skip
from eposit.compiled.lens import ray
from eposit.compiled.model import cost_at

OK, NON_FINITE, OUTSIDE_LENS, BEYOND_90, COPLANAR = 0, 1, 2, 3, 4  # places in eposit.solution.STATUSES
NOT_CONVERGED, INCONSISTENT, TOO_FEW = 5, 7, 8
ROUNDING = 1e-15  # of a number: its last bits; at tan(theta) = rho a projection's are 1 + rho^2 times as large


@part(NUMBER, NUMBER)
def angle_scale2(rho2):
    """The square of a stereographic image's scale, image over angle, at the squared radius rho2."""
    return (1.0 + 0.25 * rho2) * (1.0 + 0.25 * rho2)


@compiled(WHOLE, W, WHOLE, POINTER, WHOLE, NUMBER)
def observe(w, n, pixels, row, allowance):
    """The image `row` of pixels (b, n, 2): SEEN, over the focal length, RAYS and FLOOR; its status.

    A point over the image circle, by a share of its radius up to `allowance`, counts as on it for its ray.
    """
    status, w[FLOOR] = OK, 0.0
    for i in range(n):
        u = (pixels[2 * (n * row + i)] - w[INTRINSICS + 2]) / w[INTRINSICS]
        v = (pixels[2 * (n * row + i) + 1] - w[INTRINSICS + 3]) / w[INTRINSICS + 1]
        if not abs(u + v) < math.inf:
            return NON_FINITE
        e, r = POINTS + SEEN * n + 2 * i, POINTS + RAYS * n + 3 * i
        w[e], w[e + 1] = u, v
        rho2 = u * u + v * v
        if w[ANGULAR] == 1.0:
            for k in range(3):
                w[POINTS + INFO * n + 3 * i + k] = w[POINTS + WEIGHTS * n + 3 * i + k] / angle_scale2(rho2)
        j, rounding = POINTS + INFO * n + 3 * i, ROUNDING * (1.0 + rho2)
        w[FLOOR] += (w[j] + w[j + 2]) * rounding * rounding
        excess = math.sqrt(rho2) / w[LENS + 2]
        if 1.0 < excess <= 1.0 + allowance:
            factor = (1.0 - 1e-12) / excess
            u, v = u * factor, v * factor
            rho2 = u * u + v * v
        side, cosine = ray(w, rho2)
        if not side < math.inf:
            status = OUTSIDE_LENS
        w[r], w[r + 1], w[r + 2] = u * side, v * side, cosine
    return status


@compiled(NOTHING, W, WHOLE, POINTER)
def place(w, n, points):
    """The object points (n, 3) at POINTS."""
    for i in range(3 * n):
        w[POINTS + i] = points[i]


@compiled(NOTHING, W, WHOLE, POINTER, WHOLE)
def weigh(w, n, weights, m):
    """INFO of weights (m, 3), inverse covariances in px^-2 (xx, xy, yy), m = n or 1 for all points."""
    fx, fy = w[INTRINSICS], w[INTRINSICS + 1]
    for i in range(n):
        k = 3 * min(i, m - 1)
        j, here = POINTS + INFO * n + 3 * i, POINTS + WEIGHTS * n + 3 * i
        w[j], w[j + 1], w[j + 2] = weights[k] * fx * fx, weights[k + 1] * fx * fy, weights[k + 2] * fy * fy
        w[here], w[here + 1], w[here + 2] = w[j], w[j + 1], w[j + 2]
    w[INFO_STEP] = 3.0 if m > 1 or w[ANGULAR] == 1.0 else 0.0


@compiled(NUMBER, W, WHOLE, WHOLE)
def squares_px(w, n, pose):
    """The sum of the squared reprojection errors, px^2, without weights."""
    place, step = POINTS + INFO * n, w[INFO_STEP]
    a, b, c = w[place], w[place + 1], w[place + 2]
    w[INFO_STEP] = 0.0
    w[place], w[place + 1], w[place + 2] = w[INTRINSICS] ** 2, 0.0, w[INTRINSICS + 1] ** 2
    total = cost_at(w, n, pose)
    w[place], w[place + 1], w[place + 2] = a, b, c
    w[INFO_STEP] = step
    return total


@compiled(NOTHING, W, WHOLE, POINTER, WHOLE, WHOLE)
def write_pose(w, pose, out, R, t):
    """At places R (9) and t (3) of out the pose in the object's own frame and unit."""
    for i in range(3):
        part = w[SIZE] * w[pose + 9 + i]
        for j in range(3):
            out[R + 3 * i + j] = w[pose + 3 * i + j]
            part -= w[pose + 3 * i + j] * w[CENTRE + j]
        out[t + i] = part


@compiled(NOTHING, W, POINTER, WHOLE, WHOLE)
def write_result(w, out, b, row):
    """The pose at MINIMA as that of the image `row` of b."""
    write_pose(w, MINIMA, out, POSE * b + 9 * row, (POSE + 9) * b + 3 * row)


@compiled(NOTHING, W, WHOLE)
def no_pose(w, pose):
    """At pose NaN."""
    for i in range(12):
        w[pose + i] = math.nan
