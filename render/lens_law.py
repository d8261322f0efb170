"""The inverse lens laws in Dr.Jit, for the closed-form renderer and for the sensor plugin.

The laws stand here a second time (`eposit.lens` has them in NumPy); tests hold both against OpenCV and closed forms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from eposit import get_lens
from eposit.lens import KANNALA_BRANDT
from render import backend
from render.device import DeviceFloat

INVERSION_STEPS = 24  # Newton steps inside a bracket; float32 needs about 6, a flat slope at the rim more
NO_IMAGE_CIRCLE = 1e30
MIN_COSINE = 0.02  # at the rim of an orthogonal lens theta's slope is infinite: over a cell of 0.2 px it is 1 / 0.02


@dataclass(frozen=True, slots=True)
class DeviceLens:
    """A lens law with its numbers as opaque Dr.Jit scalars, so that one kernel serves all cameras of a lens."""

    name: str
    coefficients: list[DeviceFloat]  # k1 to k4 of kannala_brandt, else none
    rho_max: DeviceFloat  # normalised radius of the image circle
    theta_max: DeviceFloat  # rad


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
    numbers = [dr.opaque(mi.Float, value) for value in (*coefficients, circle, law.theta_max)]
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
    assert law.name == KANNALA_BRANDT
    theta, slope = _invert_polynomial(law, rho)
    sine, cosine = dr.sincos(theta)
    return IncidenceAngle(sine, cosine, 1.0 / slope)


def _invert_polynomial(law: DeviceLens, rho: DeviceFloat) -> tuple[DeviceFloat, DeviceFloat]:
    """theta of the Kannala-Brandt polynomial and d rho / d theta: Newton's method kept inside a shrinking bracket."""
    mi, dr = backend.load(), backend.jit()
    k1, k2, k3, k4 = law.coefficients
    low, high = mi.Float(0.0), mi.Float(law.theta_max)
    theta, slope = dr.minimum(rho, law.theta_max), mi.Float(1.0)
    for _ in range(INVERSION_STEPS):
        t2 = theta * theta
        value = theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
        slope = 1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)))
        excess = value - rho
        low, high = dr.select(excess < 0.0, theta, low), dr.select(excess >= 0.0, theta, high)
        proposal = theta - excess / slope
        theta = dr.select((proposal >= low) & (proposal <= high), proposal, 0.5 * (low + high))
    return theta, slope
