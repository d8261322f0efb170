"""The cost of a pose and its derivatives, for one image.

A pose is 12 numbers: R row by row, then t. It changes by a rotation vector applied on the left in the camera frame
(rad), then a translation: six numbers in this order. The cost is the sum over the points of d^T P d, where d is
projection minus observation over the focal length and P, given as (xx, xy, yy), the inverse covariance of the point
in that unit.

Four points at a time are taken side by side, each in its lane. Lanes beyond the last point repeat it without weight.
"""

from __future__ import annotations

import math

from eposit.compiled.kernel import NUMBER, NUMBERS, WHOLE, W, compiled, four, part, total
from eposit.compiled.layout import INFO, INFO_STEP, POINTS, SEEN
from eposit.compiled.lens import radial_of_four

THREE = (NUMBERS, NUMBERS, NUMBERS)


@part(THREE, W, WHOLE, WHOLE)
def _points(w, first, n):
    """The object points from `first` on: their coordinates."""
    a, end = POINTS + 3 * first, POINTS + 3 * n - 3
    b, c, d = min(a + 3, end), min(a + 6, end), min(a + 9, end)
    x, y = four(w[a], w[b], w[c], w[d]), four(w[a + 1], w[b + 1], w[c + 1], w[d + 1])
    return x, y, four(w[a + 2], w[b + 2], w[c + 2], w[d + 2])


@part((NUMBERS, NUMBERS), W, WHOLE, WHOLE)
def _seen(w, first, n):
    """The image points from `first` on."""
    a, end = POINTS + SEEN * n + 2 * first, POINTS + SEEN * n + 2 * n - 2
    b, c, d = min(a + 2, end), min(a + 4, end), min(a + 6, end)
    return four(w[a], w[b], w[c], w[d]), four(w[a + 1], w[b + 1], w[c + 1], w[d + 1])


@part(THREE, W, WHOLE, WHOLE)
def _weights(w, first, n):
    """Their inverse covariances, as (xx, xy, yy)."""
    a, step = POINTS + INFO * n + int(w[INFO_STEP]) * first, int(w[INFO_STEP])
    b = a + step if first + 1 < n else a
    c = b + step if first + 2 < n else b
    d = c + step if first + 3 < n else c
    there = four(1.0, 1.0 if first + 1 < n else 0.0, 1.0 if first + 2 < n else 0.0, 1.0 if first + 3 < n else 0.0)
    p00, p01 = four(w[a], w[b], w[c], w[d]), four(w[a + 1], w[b + 1], w[c + 1], w[d + 1])
    return there * p00, there * p01, there * four(w[a + 2], w[b + 2], w[c + 2], w[d + 2])


@compiled(NUMBER, W, WHOLE, WHOLE)
def cost_at(w, n, pose):
    """The cost of the pose at place `pose`; infinite where a point has no image."""
    cost = four(0.0, 0.0, 0.0, 0.0)
    for first in range(0, n, 4):
        a, b, c = _points(w, first, n)
        x = w[pose] * a + w[pose + 1] * b + w[pose + 2] * c + w[pose + 9]
        y = w[pose + 3] * a + w[pose + 4] * b + w[pose + 5] * c + w[pose + 10]
        z = w[pose + 6] * a + w[pose + 7] * b + w[pose + 8] * c + w[pose + 11]
        s = radial_of_four(w, x * x + y * y, z)[0]
        seen_x, seen_y = _seen(w, first, n)
        u, v = s * x - seen_x, s * y - seen_y
        p00, p01, p11 = _weights(w, first, n)
        cost += p00 * u * u + 2.0 * p01 * u * v + p11 * v * v
    whole = total(cost)
    return whole if whole < math.inf else math.inf


@compiled(NUMBER, W, WHOLE, WHOLE, NUMBER, WHOLE, WHOLE)
def derivatives(w, n, pose, second, g, H):
    """The cost; at g (6) and H (6, 6), upper triangle, half its gradient and Hessian.

    second: 1.0 for the full Hessian, 0.0 for J^T J alone. With a = R x, the force f = J_p^T P d on a point and
    M = J_p^T P J_p + second sum_k (P d)_k grad^2 p_k, the Hessian is the sum of A^T M A with A = [-[a]_x, I], and for
    the rotation of second ((a f^T + f a^T) / 2 - (a.f) I).
    """
    r0, r1, r2 = w[pose], w[pose + 1], w[pose + 2]
    r3, r4, r5 = w[pose + 3], w[pose + 4], w[pose + 5]
    r6, r7, r8 = w[pose + 6], w[pose + 7], w[pose + 8]
    t0, t1, t2 = w[pose + 9], w[pose + 10], w[pose + 11]
    cost = g0 = g1 = g2 = g3 = g4 = g5 = four(0.0, 0.0, 0.0, 0.0)
    h00 = h01 = h02 = h11 = h12 = h22 = cost
    h03 = h04 = h05 = h13 = h14 = h15 = h23 = h24 = h25 = cost
    h33 = h34 = h35 = h44 = h45 = h55 = cost
    for first in range(0, n, 4):
        o0, o1, o2 = _points(w, first, n)
        a0 = r0 * o0 + r1 * o1 + r2 * o2
        a1 = r3 * o0 + r4 * o1 + r5 * o2
        a2 = r6 * o0 + r7 * o1 + r8 * o2
        x, y, z = a0 + t0, a1 + t1, a2 + t2
        s, s_q, s_z, s_qq, s_qz, s_zz = radial_of_four(w, x * x + y * y, z)
        seen_x, seen_y = _seen(w, first, n)
        u, v = s * x - seen_x, s * y - seen_y
        p00, p01, p11 = _weights(w, first, n)
        e0, e1 = p00 * u + p01 * v, p01 * u + p11 * v
        cost += u * e0 + v * e1
        ux, uy, uz = s + 2.0 * x * x * s_q, 2.0 * x * y * s_q, x * s_z
        vy, vz = s + 2.0 * y * y * s_q, y * s_z
        f0, f1, f2 = ux * e0 + uy * e1, uy * e0 + vy * e1, uz * e0 + vz * e1
        x0, x1, x2 = p00 * ux + p01 * uy, p00 * uy + p01 * vy, p00 * uz + p01 * vz
        y0, y1, y2 = p01 * ux + p11 * uy, p01 * uy + p11 * vy, p01 * uz + p11 * vz
        m00, m01, m02 = ux * x0 + uy * y0, ux * x1 + uy * y1, ux * x2 + uy * y2
        m11, m12, m22 = uy * x1 + vy * y1, uy * x2 + vy * y2, uz * x2 + vz * y2
        if second != 0.0:
            along = e0 * x + e1 * y
            m00 += along * (2.0 * s_q + 4.0 * x * x * s_qq) + 4.0 * e0 * x * s_q
            m01 += along * 4.0 * x * y * s_qq + 2.0 * (e0 * y + e1 * x) * s_q
            m11 += along * (2.0 * s_q + 4.0 * y * y * s_qq) + 4.0 * e1 * y * s_q
            m02 += along * 2.0 * x * s_qz + e0 * s_z
            m12 += along * 2.0 * y * s_qz + e1 * s_z
            m22 += along * s_zz
        g0 += a1 * f2 - a2 * f1
        g1 += a2 * f0 - a0 * f2
        g2 += a0 * f1 - a1 * f0
        g3 += f0
        g4 += f1
        g5 += f2
        k00, k01, k02 = a1 * m02 - a2 * m01, a1 * m12 - a2 * m11, a1 * m22 - a2 * m12
        k10, k11, k12 = a2 * m00 - a0 * m02, a2 * m01 - a0 * m12, a2 * m02 - a0 * m22
        k20, k21, k22 = a0 * m01 - a1 * m00, a0 * m11 - a1 * m01, a0 * m12 - a1 * m02
        h03 += k00
        h04 += k01
        h05 += k02
        h13 += k10
        h14 += k11
        h15 += k12
        h23 += k20
        h24 += k21
        h25 += k22
        h33 += m00
        h34 += m01
        h35 += m02
        h44 += m11
        h45 += m12
        h55 += m22
        f0, f1, f2 = second * f0, second * f1, second * f2
        b0, b1, b2 = a0 * f0, a1 * f1, a2 * f2
        h00 += a1 * k02 - a2 * k01 - b1 - b2
        h01 += a2 * k00 - a0 * k02 + 0.5 * (a0 * f1 + a1 * f0)
        h02 += a0 * k01 - a1 * k00 + 0.5 * (a0 * f2 + a2 * f0)
        h11 += a2 * k10 - a0 * k12 - b0 - b2
        h12 += a0 * k11 - a1 * k10 + 0.5 * (a1 * f2 + a2 * f1)
        h22 += a0 * k21 - a1 * k20 - b0 - b1
    w[g], w[g + 1], w[g + 2] = total(g0), total(g1), total(g2)
    w[g + 3], w[g + 4], w[g + 5] = total(g3), total(g4), total(g5)
    w[H], w[H + 1], w[H + 2] = total(h00), total(h01), total(h02)
    w[H + 3], w[H + 4], w[H + 5] = total(h03), total(h04), total(h05)
    w[H + 7], w[H + 8], w[H + 9] = total(h11), total(h12), total(h13)
    w[H + 10], w[H + 11], w[H + 14] = total(h14), total(h15), total(h22)
    w[H + 15], w[H + 16], w[H + 17] = total(h23), total(h24), total(h25)
    w[H + 21], w[H + 22], w[H + 23] = total(h33), total(h34), total(h35)
    w[H + 28], w[H + 29], w[H + 35] = total(h44), total(h45), total(h55)
    whole = total(cost)
    return whole if whole < math.inf else math.inf
