"""Perspective from three points on bearings: every pose of a triangle, so that no basin is missed.

Source:
    Grunert 1841 in the form of Haralick et al. 1994 (law of cosines, one quartic); the elimination is worked out here.
"""

from __future__ import annotations

import math

from eposit.compiled.kernel import NOTHING, NUMBER, WHOLE, W, compiled
from eposit.compiled.layout import CORNERS, POINTS, RAYS, SCRATCH
from eposit.compiled.quartic import quartic_roots

ROOTS, THERE, HERE, EDGES = SCRATCH, SCRATCH + 10, SCRATCH + 20, SCRATCH + 30


@compiled(NOTHING, W, WHOLE)
def widest_triangle(w, n):
    """At CORNERS three points of large area: far from the centroid, far from that, far from their line."""
    x = y = z = ex = ey = ez = 0.0
    for corner in range(3):
        largest, best = -1.0, 0
        for i in range(n):
            o = POINTS + 3 * i
            dx, dy, dz = w[o] - x, w[o + 1] - y, w[o + 2] - z
            if corner < 2:
                size = dx * dx + dy * dy + dz * dz
            else:
                size = (ey * dz - ez * dy) ** 2 + (ez * dx - ex * dz) ** 2 + (ex * dy - ey * dx) ** 2
            if size > largest:
                largest, best = size, i
        w[CORNERS + corner] = best
        o = POINTS + 3 * best
        ex, ey, ez = w[o] - x, w[o + 1] - y, w[o + 2] - z
        x, y, z = w[o], w[o + 1], w[o + 2]


@compiled(NOTHING, W, WHOLE, WHOLE)
def _frame(w, edges, out):
    """At out (9) the rotation whose columns are the first of two edges, the second less its part along it, both of unit
    length, and their cross product."""
    ax, ay, az = w[edges], w[edges + 1], w[edges + 2]
    bx, by, bz = w[edges + 3], w[edges + 4], w[edges + 5]
    over = 1.0 / math.sqrt(ax * ax + ay * ay + az * az)
    ax, ay, az = ax * over, ay * over, az * over
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    over = 1.0 / math.sqrt(nx * nx + ny * ny + nz * nz)
    nx, ny, nz = nx * over, ny * over, nz * over
    w[out], w[out + 3], w[out + 6] = ax, ay, az
    w[out + 1], w[out + 4], w[out + 7] = ny * az - nz * ay, nz * ax - nx * az, nx * ay - ny * ax
    w[out + 2], w[out + 5], w[out + 8] = nx, ny, nz


@compiled(WHOLE, W, WHOLE, WHOLE)
def p3p(w, n, poses):
    """At poses (4, 12) those of the points at CORNERS; how many there are."""
    i, j, k = int(w[CORNERS]), int(w[CORNERS + 1]), int(w[CORNERS + 2])
    oi, oj, ok = POINTS + 3 * i, POINTS + 3 * j, POINTS + 3 * k
    ri, rj, rk = oi + RAYS * n, oj + RAYS * n, ok + RAYS * n
    aa = bb = cc = cos_a = cos_b = cos_c = 0.0
    for axis in range(3):
        a, b = w[oj + axis] - w[oi + axis], w[ok + axis] - w[oi + axis]
        w[EDGES + axis], w[EDGES + 3 + axis] = a, b
        cc += a * a
        bb += b * b
        aa += (a - b) * (a - b)
        cos_a += w[rj + axis] * w[rk + axis]
        cos_b += w[ri + axis] * w[rk + axis]
        cos_c += w[ri + axis] * w[rj + axis]
    # With u = s2 / s1 and v = s3 / s1 the laws of cosines give u = N(v) / D(v) and a quartic in v.
    q1, ratio = -2.0 * cos_b, (aa - cc) / bb
    n0, n1, n2 = -1.0 - ratio, -ratio * q1, 1.0 - ratio
    d0, d1 = -2.0 * cos_c, 2.0 * cos_a
    share = cc / bb
    e0, e1, e2 = 1.0 - share, -share * q1, -share
    dd0, dd1, dd2 = d0 * d0, 2.0 * d0 * d1, d1 * d1
    w[ROOTS + 4] = dd0 * e0 + n0 * n0 + d0 * n0 * d0
    w[ROOTS + 5] = dd0 * e1 + dd1 * e0 + 2.0 * n0 * n1 + d0 * (n0 * d1 + n1 * d0)
    w[ROOTS + 6] = dd0 * e2 + dd1 * e1 + dd2 * e0 + n1 * n1 + 2.0 * n0 * n2 + d0 * (n1 * d1 + n2 * d0)
    w[ROOTS + 7] = dd1 * e2 + dd2 * e1 + 2.0 * n1 * n2 + d0 * n2 * d1
    w[ROOTS + 8] = dd2 * e2 + n2 * n2
    quartic_roots(w, ROOTS)
    _frame(w, EDGES, THERE)
    pose = poses
    for root in range(4):
        v = w[ROOTS + root]
        u = (n0 + v * (n1 + v * n2)) / (d0 + v * d1)
        s = math.sqrt(bb / (1.0 + v * (q1 + v)))
        if not (v > 0.0 and u > 0.0 and s < math.inf):
            continue
        u, v = u * s, v * s
        for axis in range(3):
            p, q, r = s * w[ri + axis], u * w[rj + axis], v * w[rk + axis]
            w[EDGES + axis], w[EDGES + 3 + axis] = q - p, r - p
            w[pose + 9 + axis] = (p + q + r) / 3.0
        _frame(w, EDGES, HERE)
        for row in range(3):
            for column in range(3):
                part = 0.0
                for axis in range(3):
                    part += w[HERE + 3 * row + axis] * w[THERE + 3 * column + axis]
                w[pose + 3 * row + column] = part
                middle = (w[oi + column] + w[oj + column] + w[ok + column]) / 3.0
                w[pose + 9 + row] -= part * middle
        if abs(w[pose] + w[pose + 9]) < math.inf:
            pose += 12
    return (pose - poses) // 12


@compiled(NUMBER, W, WHOLE, WHOLE, NUMBER)
def ray_misfit(w, n, pose, limit):
    """Sum over the points of the squared distance between the rays and the pose's; some sum above limit if it is."""
    total = 0.0
    for i in range(n):
        o = POINTS + 3 * i
        r = o + RAYS * n
        a, b, c = w[o], w[o + 1], w[o + 2]
        x = w[pose] * a + w[pose + 1] * b + w[pose + 2] * c + w[pose + 9]
        y = w[pose + 3] * a + w[pose + 4] * b + w[pose + 5] * c + w[pose + 10]
        z = w[pose + 6] * a + w[pose + 7] * b + w[pose + 8] * c + w[pose + 11]
        over = 1.0 / math.sqrt(x * x + y * y + z * z)
        total += (x * over - w[r]) ** 2 + (y * over - w[r + 1]) ** 2 + (z * over - w[r + 2]) ** 2
        if total > limit:
            break
    return total
