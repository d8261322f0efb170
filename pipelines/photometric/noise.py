"""The noise of a picture's pixels, from what a fit leaves: its variance grows with the grey value.

A picture's edges may be rougher than the model's: ink bleeds, a point spread is no gaussian, a rendered edge has noise
of its own. That is no more than a variance, too, as long as it favours no direction.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from eposit.arrays import Array
from pipelines.spread import NORMAL_MAD

ROUNDING = 1.0 / 12.0  # variance of rounding to whole grey values
ENDS = 0.25  # of the range of grey values: what is taken for dark and for bright
RANGE = (5.0, 95.0)  # percentiles
EDGE_SHARE = 0.25  # of the strongest slope of the picture: from there a pixel lies on an edge


class Noise(NamedTuple):
    """Variance of a pixel: shot noise on top of a constant, and what edges add."""

    constant: float  # grey values squared
    per_grey: float  # grey values
    per_slope: float  # of the picture's slope squared: px^2, as if edges were displaced at random

    def variance(self, grey: Array, slope: Array) -> Array:
        """(n,) variances at grey values, where the picture has a slope, grey values per px."""
        return np.maximum(self.constant + self.per_grey * grey, ROUNDING) + self.per_slope * slope**2

    @staticmethod
    def of(residuals: Array, grey: Array, slope: Array) -> Noise:
        """A line through the robust variances of dark and of bright pixels, and the excess of those on edges.

        Raises:
            ValueError: no dark or no bright pixels away from edges, or no edges.
        Source:
            EMVA Standard 1288, release 4.0: the photon transfer curve of a linear camera is a straight line.
        """
        low, high = np.percentile(grey, RANGE)
        edge = slope > EDGE_SHARE * slope.max()
        dark = (grey <= low + ENDS * (high - low)) & ~edge
        bright = (grey >= high - ENDS * (high - low)) & ~edge
        if not (np.any(dark) and np.any(bright) and np.any(edge)):
            raise ValueError("the picture has no dark and bright areas with edges between them; give one of a board")
        dark_grey, bright_grey = float(np.mean(grey[dark])), float(np.mean(grey[bright]))
        dark_variance, bright_variance = _variance(residuals[dark]), _variance(residuals[bright])
        per_grey = max((bright_variance - dark_variance) / max(bright_grey - dark_grey, 1.0), 0.0)
        plain = Noise(max(dark_variance - per_grey * dark_grey, ROUNDING), per_grey, 0.0)
        usual = plain.variance(grey[edge], slope[edge])
        excess = _variance(residuals[edge] / np.sqrt(usual)) - 1.0
        return plain._replace(per_slope=max(excess, 0.0) * float(np.median(usual) / np.median(slope[edge] ** 2)))


def _variance(residuals: Array) -> float:
    return float((NORMAL_MAD * np.median(np.abs(residuals))) ** 2)
