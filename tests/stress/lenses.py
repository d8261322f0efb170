"""Three lenses, from their formulas: r is the distance from the principal point over f, t the angle from the axis.

pinhole: r = tan t. equidistance: r = t. kannala_brandt: r = t + k1 t^3 + k2 t^5 + k3 t^7 + k4 t^9 (Kannala and Brandt
2006, the symmetric terms). Camera axes: x right, y down, z forward; pixel centres at integers.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

NEWTON_STEPS = 12  # from the equidistant angle; the last ones change nothing


@dataclass(frozen=True)
class Lens:
    """One camera."""

    kind: str  # "pinhole", "equidistance" or "kannala_brandt"
    fx: float  # px
    fy: float
    cx: float
    cy: float
    k: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    skew: float = 0.0  # px to the right for each row: a camera that pans while rows are read
    sway: float = 0.0  # amplitude, px, to the sides while rows are read: a camera that shakes
    sway_rows: float = 120.0

    def project(self, points):
        """(n, 2) px of points (n, 3) in the camera; NaN where the lens has no image."""
        x, y, z = points.T
        across = np.hypot(x, y)
        angle = np.arctan2(across, z)
        radius = self._radius(angle) / np.where(across > 0.0, across, 1.0)
        row = self.cy + self.fy * radius * y
        return np.stack((self.cx + self.fx * radius * x + self._aside(row), row), axis=1)

    def rays(self, x, y):
        """Unit directions (..., 3) of pixels; NaN beyond what the lens sees."""
        u, v = (x - self._aside(y) - self.cx) / self.fx, (y - self.cy) / self.fy
        radius = np.hypot(u, v)
        angle = self._angle(radius)
        scale = np.sin(angle) / np.where(radius > 0.0, radius, 1.0)
        return np.stack((scale * u, scale * v, np.cos(angle)), axis=-1)

    def _aside(self, row):
        return self.skew * (row - self.cy) + self.sway * np.sin(2.0 * np.pi * row / self.sway_rows)

    def _radius(self, angle):
        if self.kind == "pinhole":
            return np.tan(np.where(angle < 1.55, angle, np.nan))
        if self.kind == "equidistance":
            return angle
        return angle * (1.0 + self._terms(angle))

    def _angle(self, radius):
        if self.kind == "pinhole":
            return np.arctan(radius)
        if self.kind == "equidistance":
            return np.where(radius < np.pi, radius, np.nan)
        angle = np.minimum(radius, 1.6)
        for _ in range(NEWTON_STEPS):
            angle = angle - (angle * (1.0 + self._terms(angle)) - radius) / (1.0 + self._slope_terms(angle))
        return np.where((angle >= 0.0) & (angle < 1.7), angle, np.nan)

    def _terms(self, angle):
        square = angle**2
        return sum(k * square ** (i + 1) for i, k in enumerate(self.k))

    def _slope_terms(self, angle):
        square = angle**2
        return sum((2 * i + 3) * k * square ** (i + 1) for i, k in enumerate(self.k))
