"""The two poses of points in or near a plane, from a homography on bearings.

Source:
    Direct linear transform of bearing x (H point) = 0 (Hartley and Zisserman, section 4.1), with bearings in place of
    image points so that rays beyond 90 degrees take part. Collins and Bartoli 2014, Infinitesimal plane-based pose
    estimation: the first derivatives of the homography at the centroid give two rotations.
"""

from __future__ import annotations

import math

from eposit.compiled.kernel import NOTHING, WHOLE, W, compiled
from eposit.compiled.layout import FLAT, PLANE, POINTS, RAYS, SCRATCH

SHIFT = 1e-13  # of the trace, added to the normal matrix so that it has a factor where the data are exact
INVERSE_STEPS = 3  # the least eigenvalue is thousands of times below the next
H, TURN, LOCAL, HERE, N = SCRATCH, SCRATCH + 9, SCRATCH + 18, SCRATCH + 27, SCRATCH + 36


@compiled(NOTHING, W, WHOLE, WHOLE)
def turn_to_axis(w, vector, out):
    """At out (9) the shortest rotation of the unit vector onto the z axis."""
    x, y, z = w[vector], w[vector + 1], w[vector + 2]
    flip = 1.0
    if z < -0.5:  # the shortest rotation is ill-conditioned near -z: first turn half a revolution about x
        flip, y, z = -1.0, -y, -z
    over = 1.0 / (1.0 + z)
    w[out], w[out + 1], w[out + 2] = 1.0 - x * x * over, -x * y * over * flip, -x * flip
    w[out + 3], w[out + 4], w[out + 5] = -x * y * over, (1.0 - y * y * over) * flip, -y * flip
    w[out + 6], w[out + 7], w[out + 8] = x, y * flip, z * flip


@compiled(NOTHING, W)
def _least_eigenvector(w):
    """At H by inverse iteration on the lower triangle at N (9, 9), which is overwritten by its factor."""
    trace = 0.0
    for i in range(9):
        trace += w[N + 10 * i]
        w[H + i] = 1.0
    for j in range(9):
        pivot = w[N + 10 * j] + SHIFT * trace
        for k in range(j):
            pivot -= w[N + 9 * j + k] * w[N + 9 * j + k]
        pivot = math.sqrt(max(pivot, SHIFT * trace))
        w[N + 10 * j] = pivot
        for i in range(j + 1, 9):
            part = w[N + 9 * i + j]
            for k in range(j):
                part -= w[N + 9 * i + k] * w[N + 9 * j + k]
            w[N + 9 * i + j] = part / pivot
    for step in range(INVERSE_STEPS):
        if step > 0:  # the first forward solution is left out: any vector will do
            for i in range(9):
                part = w[H + i]
                for k in range(i):
                    part -= w[N + 9 * i + k] * w[H + k]
                w[H + i] = part / w[N + 10 * i]
        size = 0.0
        for i in range(8, -1, -1):
            part = w[H + i]
            for k in range(i + 1, 9):
                part -= w[N + 9 * k + i] * w[H + k]
            part /= w[N + 10 * i]
            w[H + i] = part
            size += part * part
        size = 1.0 / math.sqrt(size)
        for i in range(9):
            w[H + i] *= size


@compiled(NOTHING, W, WHOLE)
def homography(w, n):
    """At H (9) the homography, row by row, of the points in the plane to the rays."""
    for i in range(81):
        w[N + i] = 0.0
    for i in range(n):
        f, r = POINTS + FLAT * n + 2 * i, POINTS + RAYS * n + 3 * i
        x, y = w[f], w[f + 1]
        for a in range(3):
            for b in range(a + 1):
                p = (1.0 if a == b else 0.0) - w[r + a] * w[r + b]
                place = N + 27 * a + 3 * b
                w[place] += p * x * x
                w[place + 9] += p * x * y
                w[place + 10] += p * y * y
                w[place + 18] += p * x
                w[place + 19] += p * y
                w[place + 20] += p
    for a in range(1, 3):
        for b in range(a):  # blocks below the diagonal are symmetric
            place = N + 27 * a + 3 * b
            w[place + 1], w[place + 2], w[place + 11] = w[place + 9], w[place + 18], w[place + 19]
    _least_eigenvector(w)
    sign = 0.0
    for i in range(n):
        f, r = POINTS + FLAT * n + 2 * i, POINTS + RAYS * n + 3 * i
        for a in range(3):
            sign += w[r + a] * (w[H + 3 * a] * w[f] + w[H + 3 * a + 1] * w[f + 1] + w[H + 3 * a + 2])
    if sign < 0.0:
        for i in range(9):
            w[H + i] = -w[H + i]


@compiled(WHOLE, W, WHOLE, WHOLE)
def planar_poses(w, n, poses):
    """At poses (2, 12) those of the points in the plane; how many are finite."""
    homography(w, n)
    size = math.sqrt(w[H + 2] ** 2 + w[H + 5] ** 2 + w[H + 8] ** 2)
    for a in range(3):
        w[HERE + a] = w[H + 3 * a + 2] / size
    turn_to_axis(w, HERE, TURN)
    for a in range(3):  # in a camera turned to the centroid the homography's last column is (0, 0, size)
        for b in range(2):
            part = 0.0
            for c in range(3):
                part += w[TURN + 3 * a + c] * w[H + 3 * c + b]
            w[LOCAL + 3 * a + b] = part / size
    j00, j01 = w[LOCAL], w[LOCAL + 1]
    j10, j11 = w[LOCAL + 3], w[LOCAL + 4]
    trace, det = j00 * j00 + j01 * j01 + j10 * j10 + j11 * j11, j00 * j11 - j01 * j10
    scale = math.sqrt(0.5 * (trace + math.sqrt(max(trace * trace - 4.0 * det * det, 0.0))))  # largest singular value
    j00, j01 = j00 / scale, j01 / scale
    j10, j11 = j10 / scale, j11 / scale
    b0, b1 = math.sqrt(max(1.0 - j00 * j00 - j10 * j10, 0.0)), math.sqrt(max(1.0 - j01 * j01 - j11 * j11, 0.0))
    if j00 * j01 + j10 * j11 > 0.0:
        b1 = -b1
    if b0 * w[LOCAL + 6] + b1 * w[LOCAL + 7] < 0.0:  # the homography's own perspective first
        b0, b1 = -b0, -b1
    pose = poses
    for _ in range(2):
        w[HERE], w[HERE + 3], w[HERE + 6] = j00, j10, b0
        w[HERE + 1], w[HERE + 4], w[HERE + 7] = j01, j11, b1
        w[HERE + 2], w[HERE + 5], w[HERE + 8] = j10 * b1 - b0 * j11, b0 * j01 - j00 * b1, j00 * j11 - j10 * j01
        for a in range(3):
            for b in range(3):  # TURN^T HERE PLANE
                part = 0.0
                for c in range(3):
                    for d in range(3):
                        part += w[TURN + 3 * d + a] * w[HERE + 3 * d + c] * w[PLANE + 3 * c + b]
                w[pose + 3 * a + b] = part
            w[pose + 9 + a] = w[H + 3 * a + 2] / (size * scale)
        if abs(w[pose] + w[pose + 9]) < math.inf:
            pose += 12
        b0, b1 = -b0, -b1
    return (pose - poses) // 12
