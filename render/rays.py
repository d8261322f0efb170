"""Rays of a camera in Dr.Jit: the inverse lens laws, for the sensor plugin and for the tracer.

The laws stand here a second time (`eposit.lens` has them in NumPy); tests hold both against OpenCV and closed forms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from eposit import Camera, Pose, get_lens
from eposit.lens import KANNALA_BRANDT
from render import backend

INVERSION_STEPS = 24  # Newton steps inside a bracket; float32 needs about 6, a flat slope at the rim more
NO_RIM = 1e30
RIM_COSINE = 0.02  # at the rim of an orthogonal lens theta's slope is infinite: over a cell of 0.2 px it is 1 / 0.02


@dataclass(frozen=True, slots=True)
class Law:
    """A lens law with its numbers as opaque Dr.Jit scalars, so that one kernel serves all cameras of a lens."""

    name: str
    coefficients: list[Any]  # k1 to k4 of kannala_brandt, else none
    rho_max: Any  # normalised radius of the image circle
    theta_max: Any  # rad


def opaque_law(mi: Any, dr: Any, name: str, coefficients: tuple[float, ...]) -> Law:
    """The law with its constants uploaded."""
    law = get_lens(name, coefficients)
    rim = law.rho_max if np.isfinite(law.rho_max) else NO_RIM
    numbers = [dr.opaque(mi.Float, value) for value in (*coefficients, rim, law.theta_max)]
    return Law(law.name, numbers[:-2], numbers[-2], numbers[-1])


@dataclass(frozen=True, slots=True)
class Bundle:
    """Rays through points of the picture: directions in the object frame and their change over a pixel."""

    direction: Any  # Vector3f of unit length
    along_x: Any  # Vector3f, change of the direction for one pixel along x
    along_y: Any  # Vector3f, for one pixel along y
    seen: Any  # Bool, whether the point lies inside the lens's image circle


@dataclass(frozen=True, slots=True)
class View:
    """A camera at a pose, uploaded."""

    law: Law
    focal: list[Any]  # fx, fy, px
    centre: list[Any]  # cx, cy, px
    rotation: list[Any]  # nine numbers of obj_from_cam, row by row
    origin: list[Any]  # camera centre in the object frame, mm

    def rays(self, x_px: Any, y_px: Any) -> Bundle:
        """Rays through points of the picture, px, pixel centres at integers."""
        mi, dr = backend.load(), backend.jit()
        x, y = (x_px - self.centre[0]) / self.focal[0], (y_px - self.centre[1]) / self.focal[1]
        radius = dr.sqrt(x * x + y * y)
        sine, cosine, slope = sine_cosine(mi, dr, self.law, dr.minimum(radius, self.law.rho_max))
        off_axis = radius > 0.0
        inverse = dr.select(off_axis, 1.0 / radius, 0.0)
        side = dr.select(off_axis, sine * inverse, 1.0)
        ex, ey = x * inverse, y * inverse
        # direction = (x side, y side, cosine): along the radius the sine's slope counts, across it `side`.
        bend, fall = dr.select(off_axis, cosine * slope - side, 0.0), -sine * slope
        in_cam = (x * side, y * side, cosine)
        step_x = ((side + bend * ex * ex) / self.focal[0], bend * ex * ey / self.focal[0], fall * ex / self.focal[0])
        step_y = (bend * ex * ey / self.focal[1], (side + bend * ey * ey) / self.focal[1], fall * ey / self.focal[1])
        direction, along_x, along_y = (self._turn(mi, vector) for vector in (in_cam, step_x, step_y))
        return Bundle(direction, along_x, along_y, radius <= self.law.rho_max)

    def _turn(self, mi: Any, v: tuple[Any, Any, Any]) -> Any:
        r = self.rotation
        return mi.Vector3f(*(r[i] * v[0] + r[i + 1] * v[1] + r[i + 2] * v[2] for i in (0, 3, 6)))


def view_of(camera: Camera, cam_from_obj: Pose) -> View:
    """Upload a camera at a pose."""
    mi, dr = backend.load(), backend.jit()
    obj_from_cam = cam_from_obj.inverse()
    numbers = [camera.fx, camera.fy, camera.cx, camera.cy, *obj_from_cam.R.ravel(), *obj_from_cam.t]
    up = [dr.opaque(mi.Float, float(value)) for value in numbers]
    return View(opaque_law(mi, dr, camera.lens, camera.coefficients), up[:2], up[2:4], up[4:13], up[13:])


def sine_cosine(mi: Any, dr: Any, law: Law, rho: Any) -> tuple[Any, Any, Any]:
    """sin and cos of theta(rho), each in the form that loses least in float32, and d theta / d rho."""
    if law.name == "orthogonal":
        cosine = dr.safe_sqrt((1.0 - rho) * (1.0 + rho))
        return rho, cosine, 1.0 / dr.maximum(cosine, RIM_COSINE)
    if law.name == "perspective":
        cosine = dr.rsqrt(1.0 + rho * rho)
        return rho * cosine, cosine, cosine * cosine
    if law.name == "equidistance":
        return *dr.sincos(rho), 1.0
    half = 0.5 * rho
    if law.name == "equisolid":  # half is sin(theta / 2)
        root = dr.safe_sqrt((1.0 - half) * (1.0 + half))
        return 2.0 * half * root, 1.0 - 2.0 * half * half, 1.0 / dr.maximum(root, RIM_COSINE)
    if law.name == "stereographic":  # half is tan(theta / 2)
        scale = 1.0 / (1.0 + half * half)
        return 2.0 * half * scale, (1.0 - half) * (1.0 + half) * scale, scale
    assert law.name == KANNALA_BRANDT
    theta, slope = _invert_polynomial(mi, dr, law, rho)
    return *dr.sincos(theta), 1.0 / slope


def _invert_polynomial(mi: Any, dr: Any, law: Law, rho: Any) -> tuple[Any, Any]:
    """theta of the Kannala-Brandt polynomial and its slope: Newton's method kept inside a shrinking bracket."""
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
