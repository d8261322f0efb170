"""Radially symmetric lens laws: normalised image radius against incidence angle.

Every law is a function rho(theta) = r / f, with theta in radians from the optical axis.
g(theta) = sin(theta) / rho(theta) is the denominator in Table I of the EPOSIT paper (Kang et al.),
so that the paper's ratio to the pinhole radius is G(theta) = cos(theta) / g(theta).
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from eposit.arrays import Array, Mask

LensFunction = Callable[[Array], Array]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lens:
    """One law. The raw functions are smooth and unmasked; `rho` and `theta` mask what the lens cannot see."""

    name: str
    raw_rho: LensFunction  # normalised radius from theta (rad)
    raw_slope: LensFunction  # d rho / d theta from theta (rad)
    raw_g: LensFunction  # sin(theta) / rho(theta), finite at 0
    raw_theta: LensFunction  # theta (rad) from normalised radius
    theta_max: float  # rad, the largest incidence angle
    includes_max: bool  # whether theta_max itself has an image
    rho_max: float  # normalised radius at theta_max, possibly infinite

    def sees(self, theta: ArrayLike) -> Mask:
        """Mask of incidence angles (rad, any shape) that have an image. NaN is not seen."""
        angle = np.asarray(theta, dtype=np.float64)
        below = angle <= self.theta_max if self.includes_max else angle < self.theta_max
        return below & (angle >= 0.0)

    def rho(self, theta: ArrayLike) -> Array:
        """Normalised radius r / f for incidence angles (rad, any shape); NaN where the lens cannot see."""
        return self._masked(self.raw_rho, theta)

    def slope(self, theta: ArrayLike) -> Array:
        """d rho / d theta for incidence angles (rad, any shape); NaN where the lens cannot see."""
        return self._masked(self.raw_slope, theta)

    def g(self, theta: ArrayLike) -> Array:
        """sin(theta) / rho(theta), 1 at theta = 0; NaN where the lens cannot see (paper, equation 6)."""
        return self._masked(self.raw_g, theta)

    def theta(self, rho: ArrayLike) -> Array:
        """Incidence angle (rad) for normalised radii (any shape); NaN for radii that no ray reaches."""
        radius = np.asarray(rho, dtype=np.float64)
        reached = (radius >= 0.0) & (radius <= self.rho_max)
        angle = self.raw_theta(np.where(reached, radius, 0.0))
        return np.where(reached & self.sees(angle), angle, np.nan)

    def _masked(self, law: LensFunction, theta: ArrayLike) -> Array:
        angle = np.asarray(theta, dtype=np.float64)
        seen = self.sees(angle)
        return np.where(seen, law(np.where(seen, angle, 0.0)), np.nan)


LENSES: dict[str, Lens] = {
    lens.name: lens
    for lens in (
        Lens(
            name="perspective",
            raw_rho=np.tan,
            raw_slope=lambda theta: 1.0 / np.cos(theta) ** 2,
            raw_g=np.cos,
            raw_theta=np.arctan,
            theta_max=np.pi / 2,
            includes_max=False,
            rho_max=np.inf,
        ),
        Lens(
            name="stereographic",
            raw_rho=lambda theta: 2.0 * np.tan(theta / 2.0),
            raw_slope=lambda theta: 1.0 / np.cos(theta / 2.0) ** 2,
            raw_g=lambda theta: np.cos(theta / 2.0) ** 2,
            raw_theta=lambda rho: 2.0 * np.arctan(rho / 2.0),
            theta_max=np.pi,
            includes_max=False,
            rho_max=np.inf,
        ),
        Lens(
            name="equidistance",
            raw_rho=lambda theta: theta,
            raw_slope=np.ones_like,
            raw_g=lambda theta: np.sinc(theta / np.pi),
            raw_theta=lambda rho: rho,
            theta_max=np.pi,
            includes_max=False,
            rho_max=np.pi,
        ),
        Lens(
            name="equisolid",
            raw_rho=lambda theta: 2.0 * np.sin(theta / 2.0),
            raw_slope=lambda theta: np.cos(theta / 2.0),
            raw_g=lambda theta: np.cos(theta / 2.0),
            raw_theta=lambda rho: 2.0 * np.arcsin(rho / 2.0),
            theta_max=np.pi,
            includes_max=False,
            rho_max=2.0,
        ),
        Lens(
            name="orthogonal",
            raw_rho=np.sin,
            raw_slope=np.cos,
            raw_g=np.ones_like,
            raw_theta=np.arcsin,
            theta_max=np.pi / 2,
            includes_max=True,
            rho_max=1.0,
        ),
    )
}

KANNALA_BRANDT = "kannala_brandt"
LENS_NAMES: tuple[str, ...] = (*LENSES, KANNALA_BRANDT)


def get_lens(name: str, coefficients: tuple[float, ...] = ()) -> Lens:
    """The lens called `name`; Kannala-Brandt takes four coefficients, the others none.

    Raises:
        ValueError: unknown name, wrong number of coefficients, or a polynomial that never rises.
    """
    if name == KANNALA_BRANDT:
        return kannala_brandt(tuple(float(k) for k in coefficients))
    if name not in LENSES:
        raise ValueError(f"unknown lens {name!r}; known lenses are {', '.join(LENS_NAMES)}")
    if len(coefficients):
        raise ValueError(f"lens {name!r} takes no coefficients, got {len(coefficients)}; leave `coefficients` empty")
    return LENSES[name]


@functools.lru_cache(maxsize=256)
def kannala_brandt(coefficients: tuple[float, ...]) -> Lens:
    """rho = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8), valid while it rises.

    Raises:
        ValueError: not exactly four finite coefficients.
    Source:
        Kannala and Brandt 2006, in the form of OpenCV's `cv2.fisheye`.
    """
    if len(coefficients) != 4 or not np.all(np.isfinite(coefficients)):
        raise ValueError(
            f"lens 'kannala_brandt' takes four finite coefficients k1..k4, got {list(coefficients)}; "
            "give them as in cv2.fisheye"
        )
    even = np.polynomial.Polynomial([1.0, *coefficients])  # rho / theta, in theta squared
    rise = np.polynomial.Polynomial([1.0, *(k * (2 * i + 3) for i, k in enumerate(coefficients))])
    turns = [root.real for root in np.atleast_1d(rise.roots()) if abs(root.imag) < 1e-12 and root.real > 0.0]
    turning_angle = float(np.sqrt(min(turns))) if turns else np.inf
    theta_max = min(turning_angle, np.pi)
    rho_max = float(theta_max * even(theta_max**2))

    def raw_rho(theta: Array) -> Array:
        return theta * even(theta**2)

    def raw_slope(theta: Array) -> Array:
        return rise(theta**2)

    return Lens(
        name=KANNALA_BRANDT,
        raw_rho=raw_rho,
        raw_slope=raw_slope,
        raw_g=lambda theta: np.sinc(theta / np.pi) / even(theta**2),
        raw_theta=lambda rho: _invert_rising(raw_rho, raw_slope, rho, theta_max),
        theta_max=theta_max,
        includes_max=theta_max < np.pi,
        rho_max=rho_max,
    )


def _invert_rising(law: LensFunction, slope: LensFunction, rho: Array, theta_max: float) -> Array:
    """Newton's method kept inside a shrinking bracket, so that a flat slope at theta_max cannot throw it out."""
    low, high = np.zeros_like(rho), np.full_like(rho, theta_max)
    theta = np.minimum(rho, theta_max)
    for _ in range(80):
        excess = law(theta) - rho
        low, high = np.where(excess < 0.0, theta, low), np.where(excess >= 0.0, theta, high)
        with np.errstate(divide="ignore", invalid="ignore"):
            proposal = theta - excess / slope(theta)
        inside = (proposal >= low) & (proposal <= high)
        following = np.where(inside, proposal, 0.5 * (low + high))
        if np.all(np.abs(following - theta) <= 2e-16 * theta_max):
            return following
        theta = following
    return theta
