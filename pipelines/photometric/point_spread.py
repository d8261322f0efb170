"""The point spread as a gaussian of unknown width: pictures spread by it, and how they change with place and width."""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np

from eposit.arrays import Array
from render.region import Image

REACH_SIGMA = 5.0  # beyond which lies 6e-7 of a gaussian
LEAST_SIGMA_PX, MOST_SIGMA_PX = 0.3, 8.0  # a gaussian sampled at pixel centres stands for itself from about 0.5


class PointSpread(NamedTuple):
    """(2 k + 1,) weights along one axis; over the picture they multiply."""

    spread: Array  # of sum 1
    slope: Array  # derivative along the axis, per px
    growth: Array  # derivative with respect to the width, per px
    sigma_px: float

    @staticmethod
    def of(sigma_px: float) -> PointSpread:
        """Samples at pixel centres, as the sensor model takes them."""
        reach = int(np.ceil(REACH_SIGMA * sigma_px))
        x = np.arange(-reach, reach + 1.0)
        weights = np.exp(-0.5 * (x / sigma_px) ** 2)
        growth = weights * x**2 / sigma_px**3
        total = weights.sum()
        share = weights / total
        return PointSpread(share, -x / sigma_px**2 * share, growth / total - share * (growth.sum() / total), sigma_px)

    def blurred(self, image: Image) -> Image:
        """The picture after the point spread."""
        return _filtered(image, self.spread, self.spread)

    def gradient(self, image: Image) -> tuple[Image, Image]:
        """The blurred picture's derivatives along x and along y, per px."""
        return _filtered(image, self.slope, self.spread), _filtered(image, self.spread, self.slope)

    def widened(self, image: Image) -> Image:
        """The blurred picture's derivative with respect to sigma, per px."""
        return _filtered(image, self.growth, self.spread) + _filtered(image, self.spread, self.growth)


def _filtered(image: Image, along_x: Array, along_y: Array) -> Image:
    """Convolution; OpenCV correlates, so the weights are turned round."""
    across, down = along_x[::-1].copy(), along_y[::-1].copy()
    spread = cv2.sepFilter2D(image, -1, across, down, borderType=cv2.BORDER_REPLICATE)
    return spread.astype(np.float32, copy=False)
