"""What a camera makes of light before it is a picture, and the light before it.

The lens blurs light, the sensor's pixels average it; then come a tone curve and a sharpening of what that gives. Models
of blurred edges hold for light.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap
from pipelines.detection.corner_sites import CornerSites
from pipelines.detection.finders import Grey
from pipelines.detection.sharpening import Sharpening, measured_sharpening, without_sharpening
from pipelines.detection.tone_curve import Light, decoded, measured_exponent

FULL = 255  # the brightest grey value


class Encoding(NamedTuple):
    """From light to grey values."""

    exponent: float = 1.0  # of the tone curve: grey values are light^(1 / exponent)
    sharpening: Sharpening | None = None  # behind it

    def light(self, image: Grey, around: Array) -> Light:
        """The light of a picture, on the scale of its grey values, where the board is. around: (n, 2) px, of it."""
        if self.sharpening is None:
            return decoded(image, self.exponent)
        return decoded(without_sharpening(decoded(image, 1.0), self.sharpening, around), self.exponent)

    def with_clipped(self, light: Light, image: Grey) -> Light:
        """That light, and pixels as they are that are as bright as one can be: no filter brings back what they lack.

        What is cut off below black is a halo's alone, and little.
        """
        return light if self.sharpening is None else np.where(image == FULL, np.float32(FULL), light)


PLAIN = Encoding()


def measured_encoding(
    image: Grey, plain: Light, board: BoardMap, sites: CornerSites, blur_px: float
) -> tuple[Encoding, Light]:
    """How a picture of a board is encoded, and its light.

    The sharpening is looked for first: it came last, and hides how a tone curve makes edges lean.

    plain: the picture as if it were light. blur_px: of the edges by their slopes, the pixels' own area included.
    """
    sharpening = measured_sharpening(plain, board, sites, blur_px)
    before: Grey | Light = image
    if sharpening is not None:
        before = plain = without_sharpening(plain, sharpening, board(sites.at))
        image = np.rint(plain).astype(np.uint8)  # curves of 8 bits are tried many times faster
    exponent = measured_exponent(image, plain, board, sites)
    return Encoding(exponent, sharpening), plain if exponent == 1.0 else decoded(before, exponent)
