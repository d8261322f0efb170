"""Radially symmetric lens laws: normalised image radius against incidence angle.

Every law is a function rho(theta) = r / f, with theta in radians from the optical axis.
g(theta) = sin(theta) / rho(theta) is the denominator in Table I of the EPOSIT paper (Kang et al.),
so that the paper's ratio to the pinhole radius is G(theta) = cos(theta) / g(theta).
"""

from __future__ import annotations

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
        with np.errstate(all="ignore"):  # of radii whose powers no number holds
            angle = self.raw_theta(np.where(reached, radius, 0.0))
        return np.where(reached & self.sees(angle), angle, np.nan)

    def _masked(self, law: LensFunction, theta: ArrayLike) -> Array:
        angle = np.asarray(theta, dtype=np.float64)
        seen = self.sees(angle)
        return np.where(seen, law(np.where(seen, angle, 0.0)), np.nan)


def invert_rising(law: LensFunction, slope: LensFunction, rho: Array, theta_max: float, start: Array) -> Array:
    """theta of radii under a law that rises up to theta_max, from first guesses `start`.

    Newton's method kept inside a shrinking bracket, so that a flat slope at theta_max cannot throw it out.
    """
    low, high = np.zeros_like(rho), np.full_like(rho, theta_max)
    theta = start
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
