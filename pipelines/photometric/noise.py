"""The noise of a picture's pixels, from what a fit leaves: its variance grows linearly with the grey value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from eposit.arrays import Array

ROUNDING = 1.0 / 12.0  # variance of rounding to whole grey values
TO_DEVIATION = 1.4826  # a normal deviation over its median absolute one
ENDS = 0.25  # of the range of grey values: what is taken for dark and for bright
RANGE = (5.0, 95.0)  # percentiles


class Noise(NamedTuple):
    """Variance of a pixel as a function of its expected grey value: shot noise on top of a constant."""

    constant: float  # grey values squared
    per_grey: float  # grey values

    def variance(self, grey: Array) -> Array:
        """(n,) variances at grey values."""
        return np.maximum(self.constant + self.per_grey * grey, ROUNDING)

    @staticmethod
    def of(residuals: Array, grey: Array) -> Noise:
        """A line through the robust variances of dark and of bright pixels.

        Source:
            EMVA Standard 1288, release 4.0: the photon transfer curve of a linear camera is a straight line.
        """
        low, high = np.percentile(grey, RANGE)
        dark, bright = grey <= low + ENDS * (high - low), grey >= high - ENDS * (high - low)
        dark_grey, bright_grey = float(np.mean(grey[dark])), float(np.mean(grey[bright]))
        dark_variance, bright_variance = _variance(residuals[dark]), _variance(residuals[bright])
        slope = max((bright_variance - dark_variance) / max(bright_grey - dark_grey, 1.0), 0.0)
        return Noise(max(dark_variance - slope * dark_grey, ROUNDING), slope)


def _variance(residuals: Array) -> float:
    return float((TO_DEVIATION * np.median(np.abs(residuals))) ** 2)
