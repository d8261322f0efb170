"""Lens laws for one point at a time: the image and its derivatives, and the ray of an image point.

A point (x, y, z) of the camera frame has the image s (x, y) over the focal length, where s depends on q = x^2 + y^2 and
z alone. Each law is one branch of `radial` and one of `ray`; `eposit.lens` states the same laws for users.
"""

from __future__ import annotations

import math

from eposit.compiled.calibrated_lens import (
    SIX,
    TWO,
    double_sphere_radial,
    double_sphere_ray,
    eucm_radial,
    eucm_ray,
    pinhole_radial,
    pinhole_radial_ray,
    polynomial_radial,
    polynomial_ray,
)
from eposit.compiled.kernel import NUMBER, W, compiled, four_at_once, part
from eposit.compiled.layout import (
    EQUISOLID,
    EUCM,
    LENS,
    ORTHOGONAL,
    PERSPECTIVE,
    PINHOLE_RADIAL,
    POLYNOMIAL,
    STEREOGRAPHIC,
)


@compiled(SIX, W, NUMBER, NUMBER)
def calibrated_radial(w, q, z):
    """`radial` of a lens with coefficients."""
    kind = w[LENS]
    if kind == POLYNOMIAL:
        return polynomial_radial(w, q, z)
    if kind == PINHOLE_RADIAL:
        return pinhole_radial(w, q, z)
    if kind == EUCM:
        return eucm_radial(w, q, z)
    return double_sphere_radial(w, q, z)


@part(SIX, W, NUMBER, NUMBER)
def radial(w, q, z):
    """s, and its derivatives by q, z, qq, qz, zz. Infinite where the lens has no image."""
    kind = w[LENS]
    if kind == PERSPECTIVE:
        s = 1.0 / z if z > 0.0 else math.inf
        return s, 0.0, -s * s, 0.0, 0.0, 2.0 * s * s * s
    if kind >= POLYNOMIAL:
        return calibrated_radial(w, q, z)
    h2 = q + z * z
    i = 1.0 / math.sqrt(h2)
    i2 = i * i
    if kind == ORTHOGONAL:
        i3 = i * i2
        i5 = i3 * i2
        return i, -0.5 * i3, -z * i3, 0.75 * i5, 1.5 * z * i5, 3.0 * z * z * i5 - i3
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


radial_of_four = four_at_once(radial)  # of four points side by side


@compiled(TWO, W, NUMBER)
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
        over = 1.0 / (1.0 + quarter)
        return over, (1.0 - quarter) * over
    if kind == EQUISOLID:
        return math.sqrt(1.0 - quarter), 1.0 - 2.0 * quarter
    if kind == POLYNOMIAL:
        return polynomial_ray(w, math.sqrt(rho2))
    if kind == PINHOLE_RADIAL:
        return pinhole_radial_ray(w, math.sqrt(rho2))
    if kind == EUCM:
        return eucm_ray(w, rho2)
    return double_sphere_ray(w, rho2)
