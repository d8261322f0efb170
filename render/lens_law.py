"""The inverse lens laws in Dr.Jit, for the closed-form renderer and for the sensor plugin.

The laws stand here a second time (`eposit.lens` has them in NumPy); tests hold both against OpenCV and closed forms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from eposit import get_lens
from eposit.calibrated_lens import DOUBLE_SPHERE, EUCM, KANNALA_BRANDT, PINHOLE_RADIAL
from render import backend
from render.device import DeviceFloat

INVERSION_STEPS = 24  # Newton steps inside a bracket; float32 needs about 6, a flat slope at the rim more
NO_IMAGE_CIRCLE = 1e30
FAR_TANGENT = 1e4  # beyond what a picture shows
MIN_COSINE = 0.02  # at the rim of an orthogonal lens theta's slope is infinite: over a cell of 0.2 px it is 1 / 0.02


@dataclass(frozen=True, slots=True)
class DeviceLens:
    """A lens law with its numbers as opaque Dr.Jit scalars, so that one kernel serves all cameras of a lens."""

    name: str
    coefficients: list[DeviceFloat]  # in the order of eposit.COEFFICIENTS
    rho_max: DeviceFloat  # normalised radius of the image circle
    argument_max: DeviceFloat  # theta at the rim, rad; of pinhole_radial its tangent


class IncidenceAngle(NamedTuple):
    """The angle theta between rays and the optical axis, as a function of the normalised image radius rho."""

    sine: DeviceFloat
    cosine: DeviceFloat
    slope: DeviceFloat | float  # d theta / d rho, rad


def device_lens(name: str, coefficients: tuple[float, ...]) -> DeviceLens:
    """The law with its constants uploaded."""
    mi, dr = backend.load(), backend.jit()
    law = get_lens(name, coefficients)
    circle = law.rho_max if np.isfinite(law.rho_max) else NO_IMAGE_CIRCLE
    at_rim = law.theta_max if name != PINHOLE_RADIAL else min(float(np.tan(law.theta_max)), FAR_TANGENT)
    numbers = [dr.opaque(mi.Float, value) for value in (*coefficients, circle, at_rim)]
    return DeviceLens(law.name, numbers[:-2], numbers[-2], numbers[-1])


def incidence_angle(law: DeviceLens, rho: DeviceFloat) -> IncidenceAngle:
    """theta(rho) with its sine and cosine each in the form that loses least in float32."""
    dr = backend.jit()
    half = 0.5 * rho
    if law.name == "orthogonal":
        cosine = dr.safe_sqrt((1.0 - rho) * (1.0 + rho))
        return IncidenceAngle(rho, cosine, 1.0 / dr.maximum(cosine, MIN_COSINE))
    if law.name == "perspective":
        cosine = dr.rsqrt(1.0 + rho * rho)
        return IncidenceAngle(rho * cosine, cosine, cosine * cosine)
    if law.name == "equidistance":
        sine, cosine = dr.sincos(rho)
        return IncidenceAngle(sine, cosine, 1.0)
    if law.name == "equisolid":  # half is sin(theta / 2)
        root = dr.safe_sqrt((1.0 - half) * (1.0 + half))
        return IncidenceAngle(2.0 * half * root, 1.0 - 2.0 * half * half, 1.0 / dr.maximum(root, MIN_COSINE))
    if law.name == "stereographic":  # half is tan(theta / 2)
        scale = 1.0 / (1.0 + half * half)
        return IncidenceAngle(2.0 * half * scale, (1.0 - half) * (1.0 + half) * scale, scale)
    return _CALIBRATED[law.name](law, rho)


def _kannala_brandt(law: DeviceLens, rho: DeviceFloat) -> IncidenceAngle:
    theta, slope = _invert_polynomial(law, rho, rho)
    sine, cosine = backend.jit().sincos(theta)
    return IncidenceAngle(sine, cosine, 1.0 / slope)


def _pinhole_radial(law: DeviceLens, rho: DeviceFloat) -> IncidenceAngle:
    dr = backend.jit()
    start = rho  # far out a power of the tangent outweighs the others
    for power, k in zip((3, 5, 7), law.coefficients, strict=True):
        start = dr.select(k > 0.0, dr.minimum(start, dr.power(rho / k, 1.0 / power)), start)
    tangent, slope = _invert_polynomial(law, rho, start)
    cosine = dr.rsqrt(1.0 + tangent * tangent)
    return IncidenceAngle(tangent * cosine, cosine, cosine * cosine / slope)


def _eucm(law: DeviceLens, rho: DeviceFloat) -> IncidenceAngle:
    """Khomutenko et al. 2016; the slope is that of `eposit.calibrated_lens`, with the ray's scale for its g."""
    dr = backend.jit()
    alpha, beta = law.coefficients
    square = beta * rho * rho
    root = dr.safe_sqrt(1.0 - (2.0 * alpha - 1.0) * square)
    z = (1.0 - alpha * alpha * square) / (alpha * root + 1.0 - alpha)
    scale = dr.rsqrt(rho * rho + z * z)
    sine, cosine = rho * scale, z * scale
    rise = alpha * cosine * dr.rsqrt(beta * sine * sine + cosine * cosine) + 1.0 - alpha
    return IncidenceAngle(sine, cosine, scale * scale / dr.maximum(rise, MIN_COSINE))


def _double_sphere(law: DeviceLens, rho: DeviceFloat) -> IncidenceAngle:
    """Usenko et al. 2018; the slope is that of `eposit.calibrated_lens`, with the ray's scale for its g."""
    dr = backend.jit()
    xi, alpha = law.coefficients
    square = rho * rho
    root = dr.safe_sqrt(1.0 - (2.0 * alpha - 1.0) * square)
    z = (1.0 - alpha * alpha * square) / (alpha * root + 1.0 - alpha)
    scale = (z * xi + dr.sqrt(z * z + (1.0 - xi * xi) * square)) / (z * z + square)
    sine, cosine = rho * scale, z * scale - xi
    k = z * scale
    rise = (1.0 + xi * cosine) * (alpha * k * dr.rsqrt(sine * sine + k * k) + 1.0 - alpha)
    return IncidenceAngle(sine, cosine, scale * scale / dr.maximum(rise, MIN_COSINE))


_CALIBRATED = {
    KANNALA_BRANDT: _kannala_brandt,
    PINHOLE_RADIAL: _pinhole_radial,
    EUCM: _eucm,
    DOUBLE_SPHERE: _double_sphere,
}


def _invert_polynomial(
    law: DeviceLens, value_sought: DeviceFloat, start: DeviceFloat
) -> tuple[DeviceFloat, DeviceFloat]:
    """Argument and slope of an odd polynomial where it has a value: Newton's method kept inside a shrinking bracket."""
    mi, dr = backend.load(), backend.jit()
    k1, k2, k3, k4 = (*law.coefficients, 0.0)[:4]
    low, high = mi.Float(0.0), mi.Float(law.argument_max)
    theta, slope = dr.minimum(start, law.argument_max), mi.Float(1.0)
    for _ in range(INVERSION_STEPS):
        t2 = theta * theta
        value = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
        slope = 1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)))
        excess = value - value_sought
        low, high = dr.select(excess < 0.0, theta, low), dr.select(excess >= 0.0, theta, high)
        proposal = theta - excess / slope
        theta = dr.select((proposal >= low) & (proposal <= high), proposal, 0.5 * (low + high))
    return theta, slope
