"""Lens laws for one point at a time: the image and its derivatives, and the ray of an image point.

A point (x, y, z) of the camera frame has the image s (x, y) over the focal length, where s depends on q = x^2 + y^2 and
z alone. Each law is one branch of `radial` and one of `ray`; `eposit.lens` states the same laws for users.
"""

from __future__ import annotations

import math

from eposit.compiled.jit import part
from eposit.compiled.layout import EQUISOLID, LENS, ORTHOGONAL, PERSPECTIVE, POLYNOMIAL, STEREOGRAPHIC

NEAR_AXIS = 1e-5  # q / z^2 below which the polynomial's quotients are taken from their series: 1e-15 is left out
INVERSION_STEPS = 80


@part
def _polynomial(w, q, z, i2):
    """`radial` for rho = theta (1 + k1 theta^2 + ... + k4 theta^8); i2 = 1 / (q + z^2)."""
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


@part
def radial(w, q, z):
    """s, and its derivatives by q, z, qq, qz, zz. Infinite where the lens has no image."""
    kind = w[LENS]
    if kind == PERSPECTIVE:
        if not z > 0.0:
            return math.inf, 0.0, 0.0, 0.0, 0.0, 0.0
        s = 1.0 / z
        return s, 0.0, -s * s, 0.0, 0.0, 2.0 * s * s * s
    h2 = q + z * z
    i = 1.0 / math.sqrt(h2)
    i2 = i * i
    if kind == ORTHOGONAL:
        i3 = i * i2
        i5 = i3 * i2
        return i, -0.5 * i3, -z * i3, 0.75 * i5, 1.5 * z * i5, 3.0 * z * z * i5 - i3
    if kind == POLYNOMIAL:
        return _polynomial(w, q, z, i2)
    h = h2 * i
    k = h + z if z > 0.0 else q / (h - z)
    if kind == STEREOGRAPHIC:
        s = 2.0 / k
        s_q = -0.25 * s * s * i
        return (
            s, s_q, -s * i, -0.5 * s * s_q * i + 0.125 * s * s * i * i2, -s_q * i + 0.5 * s * i * i2, 2.0 * i * i2,
        )  # fmt: skip
    s = math.sqrt(2.0 * i / k)
    u = i2 + i / k
    s_q = -0.25 * s * u
    s_z = -0.5 * s * k * i2
    u_q = -i2 * i2 - (0.5 * k * i + 0.5) * i2 / (k * k)
    s_qz = -0.5 * (s_q * k * i2 + 0.5 * s * i * i2 - s * k * i2 * i2)
    s_zz = -0.5 * (s_z * k * i2 + s * k * i * i2 - 2.0 * s * k * z * i2 * i2)
    return s, s_q, s_z, -0.25 * (s_q * u + s * u_q), s_qz, s_zz


@part
def _inverted(w, rho):
    """theta of the polynomial: Newton's method kept inside a shrinking bracket."""
    k1, k2 = w[LENS + 4], w[LENS + 5]
    k3, k4 = w[LENS + 6], w[LENS + 7]
    low, high = 0.0, w[LENS + 1]
    theta = min(rho, high)
    for _ in range(INVERSION_STEPS):
        m = theta * theta
        excess = theta * (1.0 + m * (k1 + m * (k2 + m * (k3 + m * k4)))) - rho
        slope = 1.0 + m * (3.0 * k1 + m * (5.0 * k2 + m * (7.0 * k3 + m * 9.0 * k4)))
        if excess < 0.0:
            low = theta
        else:
            high = theta
        following = theta - excess / slope
        if not (low <= following <= high):
            following = 0.5 * (low + high)
        if abs(following - theta) <= 2e-16 * w[LENS + 1]:
            return following
        theta = following
    return theta


@part
def ray(w, rho2):
    """sin(theta) / rho and cos(theta) of an image point at the squared radius rho2; NaN where no ray reaches it."""
    kind = w[LENS]
    if kind == PERSPECTIVE:
        cosine = 1.0 / math.sqrt(1.0 + rho2)
        return cosine, cosine
    if not rho2 <= w[LENS + 2] * w[LENS + 2]:
        return math.nan, math.nan
    if kind == ORTHOGONAL:
        return 1.0, math.sqrt(1.0 - rho2)
    quarter = 0.25 * rho2
    if kind == STEREOGRAPHIC:
        part = 1.0 / (1.0 + quarter)
        return part, (1.0 - quarter) * part
    if kind == EQUISOLID:
        return math.sqrt(1.0 - quarter), 1.0 - 2.0 * quarter
    if rho2 == 0.0:
        return 1.0, 1.0
    rho = math.sqrt(rho2)
    theta = _inverted(w, rho)
    return math.sin(theta) / rho, math.cos(theta)
