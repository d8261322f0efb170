"""Lens laws with coefficients, for one point at a time; `eposit.calibrated_lens` states them for users.

s and its derivatives by q, z, qq, qz, zz, as `lens.radial`, and sin(theta) / rho and cos(theta), as `lens.ray`.
"""

from __future__ import annotations

import math

from eposit.compiled.kernel import NUMBER, W, compiled, part
from eposit.compiled.layout import LENS

SIX, TWO = (NUMBER,) * 6, (NUMBER,) * 2
NEAR_AXIS = 1e-5  # q / z^2 below which the polynomial's quotients are taken from their series: 1e-15 is left out
INVERSION_STEPS = 80
DOUBLINGS = 200


@compiled(SIX, W, NUMBER, NUMBER)
def polynomial_radial(w, q, z):
    """Of rho = theta (1 + k1 theta^2 + ... + k4 theta^8)."""
    k1, k2 = w[LENS + 4], w[LENS + 5]
    k3, k4 = w[LENS + 6], w[LENS + 7]
    if z > 0.0 and q < NEAR_AXIS * z * z:
        i = 1.0 / z
        m = q * i * i
        c1, c2 = k1 - 1.0 / 3.0, 0.2 - k1 + k2
        i3 = i * i * i
        s_z = -i * i * (1.0 + m * (3.0 * c1 + 5.0 * c2 * m))
        s_qz = -i3 * i * (3.0 * c1 + 10.0 * c2 * m)
        s_zz = i3 * (2.0 + m * (12.0 * c1 + 30.0 * c2 * m))
        return i * (1.0 + m * (c1 + c2 * m)), i3 * (c1 + 2.0 * c2 * m), s_z, 2.0 * c2 * i3 * i * i, s_qz, s_zz
    i2 = 1.0 / (q + z * z)
    r = math.sqrt(q)
    theta = math.atan2(r, z)
    m = theta * theta
    rho = theta * (1.0 + m * (k1 + m * (k2 + m * (k3 + m * k4))))
    first = 1.0 + m * (3.0 * k1 + m * (5.0 * k2 + m * (7.0 * k3 + m * 9.0 * k4)))
    second = theta * (6.0 * k1 + m * (20.0 * k2 + m * (42.0 * k3 + m * 72.0 * k4)))
    over_r = 1.0 / r
    over_q = over_r * over_r
    s = rho * over_r
    bent = second * over_r * i2 * i2
    s_q = 0.5 * (first * z * i2 - s) * over_q
    s_qq = 0.5 * (0.5 * bent * z * z - first * z * i2 * i2 - 3.0 * s_q) * over_q
    return s, s_q, -first * i2, s_qq, first * i2 * i2 - 0.5 * bent * z, bent * q + 2.0 * z * first * i2 * i2


@compiled(SIX, W, NUMBER, NUMBER)
def pinhole_radial(w, q, z):
    """Of rho = t (1 + k1 t^2 + k2 t^4 + k3 t^6), t = tan(theta): s = E(m) / z with m = q / z^2."""
    if not z > 0.0:
        return math.inf, 0.0, 0.0, 0.0, 0.0, 0.0
    k1, k2, k3 = w[LENS + 4], w[LENS + 5], w[LENS + 6]
    i = 1.0 / z
    i2 = i * i
    i3, m = i * i2, q * i2
    E = 1.0 + m * (k1 + m * (k2 + m * k3))
    first, second = k1 + m * (2.0 * k2 + m * 3.0 * k3), 2.0 * k2 + m * 6.0 * k3
    s_qz = -i3 * i * (3.0 * first + 2.0 * m * second)
    s_zz = i3 * (2.0 * E + m * (10.0 * first + 4.0 * m * second))
    return E * i, first * i3, -i2 * (E + 2.0 * m * first), second * i3 * i2, s_qz, s_zz


@part(SIX, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER, NUMBER)
def _over(D, D_q, D_z, D_qq, D_qz, D_zz):
    """s = 1 / D; infinite where D is not positive."""
    if not D > 0.0:
        return math.inf, 0.0, 0.0, 0.0, 0.0, 0.0
    s = 1.0 / D
    s2 = s * s
    s3 = 2.0 * s * s2
    s_qq, s_qz, s_zz = D_q * D_q * s3 - D_qq * s2, D_q * D_z * s3 - D_qz * s2, D_z * D_z * s3 - D_zz * s2
    return s, -D_q * s2, -D_z * s2, s_qq, s_qz, s_zz


@compiled(SIX, W, NUMBER, NUMBER)
def eucm_radial(w, q, z):
    """Of the extended unified camera model: D = alpha d + (1 - alpha) z with d^2 = beta q + z^2."""
    alpha, beta = w[LENS + 4], w[LENS + 5]
    d = math.sqrt(beta * q + z * z)
    i = alpha / d
    i3 = i / (d * d)
    return _over(
        alpha * d + (1.0 - alpha) * z, 0.5 * beta * i, z * i + (1.0 - alpha),
        -0.25 * beta * beta * i3, -0.5 * beta * z * i3, beta * q * i3,
    )  # fmt: skip


@compiled(SIX, W, NUMBER, NUMBER)
def double_sphere_radial(w, q, z):
    """Of the double sphere model: D = alpha d + (1 - alpha) k with k = xi sqrt(q + z^2) + z and d^2 = q + k^2."""
    xi, alpha = w[LENS + 4], w[LENS + 5]
    far2 = q + z * z
    i = xi / math.sqrt(far2)
    i3 = i / far2
    k = i * far2 + z
    k_q, k_z = 0.5 * i, i * z + 1.0
    k_qq, k_qz, k_zz = -0.25 * i3, -0.5 * z * i3, q * i3
    d = math.sqrt(q + k * k)
    d_q, d_z = (0.5 + k * k_q) / d, k * k_z / d
    d_qq = (k_q * k_q + k * k_qq - d_q * d_q) / d
    d_qz = (k_q * k_z + k * k_qz - d_q * d_z) / d
    d_zz = (k_z * k_z + k * k_zz - d_z * d_z) / d
    rest = 1.0 - alpha
    return _over(
        alpha * d + rest * k, alpha * d_q + rest * k_q, alpha * d_z + rest * k_z,
        alpha * d_qq + rest * k_qq, alpha * d_qz + rest * k_qz, alpha * d_zz + rest * k_zz,
    )  # fmt: skip


@compiled(NUMBER, W, NUMBER, NUMBER)
def inverted(w, rho, high):
    """x with x (1 + k1 x^2 + ... + k4 x^8) = rho, from zero up to `high`, where it rises.

    Newton's method kept inside a shrinking bracket.
    """
    k1, k2 = w[LENS + 4], w[LENS + 5]
    k3, k4 = w[LENS + 6], w[LENS + 7]
    low, least = 0.0, 2e-16 * high
    x = min(rho, high)
    for _ in range(INVERSION_STEPS):
        m = x * x
        excess = x * (1.0 + m * (k1 + m * (k2 + m * (k3 + m * k4)))) - rho
        slope = 1.0 + m * (3.0 * k1 + m * (5.0 * k2 + m * (7.0 * k3 + m * 9.0 * k4)))
        if excess < 0.0:
            low = x
        else:
            high = x
        following = x - excess / slope
        if not (low <= following <= high):
            following = 0.5 * (low + high)
        if abs(following - x) <= least:
            return following
        x = following
    return x


@compiled(TWO, W, NUMBER)
def polynomial_ray(w, rho):
    """Of the polynomial in theta."""
    if rho == 0.0:
        return 1.0, 1.0
    theta = inverted(w, rho, w[LENS + 1])
    return math.sin(theta) / rho, math.cos(theta)


@compiled(TWO, W, NUMBER)
def pinhole_radial_ray(w, rho):
    """Of the polynomial in tan(theta), whose range is doubled until it holds rho."""
    if rho == 0.0:
        return 1.0, 1.0
    k1, k2, k3 = w[LENS + 4], w[LENS + 5], w[LENS + 6]
    turn = math.tan(w[LENS + 1]) if w[LENS + 1] < 0.5 * math.pi else math.inf
    high = rho
    for _ in range(DOUBLINGS):
        m = high * high
        if high >= turn or high * (1.0 + m * (k1 + m * (k2 + m * k3))) >= rho:
            break
        high *= 2.0
    tangent = inverted(w, rho, min(high, turn))
    cosine = 1.0 / math.sqrt(1.0 + tangent * tangent)
    return tangent * cosine / rho, cosine


@compiled(TWO, W, NUMBER)
def eucm_ray(w, rho2):
    """Of the extended unified camera model."""
    alpha, square = w[LENS + 4], w[LENS + 5] * rho2
    root = math.sqrt(max(1.0 - (2.0 * alpha - 1.0) * square, 0.0))
    z = (1.0 - alpha * alpha * square) / (alpha * root + 1.0 - alpha)
    over = 1.0 / math.sqrt(rho2 + z * z)
    return over, z * over


@compiled(TWO, W, NUMBER)
def double_sphere_ray(w, rho2):
    """Of the double sphere model."""
    xi, alpha = w[LENS + 4], w[LENS + 5]
    root = math.sqrt(max(1.0 - (2.0 * alpha - 1.0) * rho2, 0.0))
    z = (1.0 - alpha * alpha * rho2) / (alpha * root + 1.0 - alpha)
    length = (z * xi + math.sqrt(z * z + (1.0 - xi * xi) * rho2)) / (z * z + rho2)
    return length, length * z - xi
