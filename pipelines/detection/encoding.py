"""What a camera makes of light before it is a picture, and the light before it.

The lens blurs light, the sensor's pixels average it; then come a tone curve and a sharpening of what that gives. Models
of blurred edges hold for light.
"""

from __future__ import annotations

from typing import NamedTuple

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap
from pipelines.detection.corner_sites import CornerSites
from pipelines.detection.finders import Grey
from pipelines.detection.sharpening import Sharpening, measured_sharpening, without_sharpening
from pipelines.detection.tone_curve import Light, decoded, measured_exponent


class Encoding(NamedTuple):
    """From light to grey values."""

    exponent: float = 1.0  # of the tone curve: grey values are light^(1 / exponent)
    sharpening: Sharpening | None = None  # behind it

    def light(self, image: Grey, around: Array) -> Light:
        """The light of a picture, on the scale of its grey values, where the board is. around: (n, 2) px, of it."""
        return decoded(_unsharpened(image, self.sharpening, around), self.exponent)


PLAIN = Encoding()


def measured_encoding(image: Grey, board: BoardMap, sites: CornerSites, blur_px: float) -> Encoding:
    """How a picture of a board is encoded. blur_px: of the edges by their slopes, the pixels' own area included.

    The sharpening is looked for first: it came last, and hides how a tone curve makes edges lean.
    """
    sharpening = measured_sharpening(decoded(image, 1.0), board, sites, blur_px)
    before = _unsharpened(image, sharpening, board(sites.at))
    return Encoding(measured_exponent(before, decoded(before, 1.0), board, sites), sharpening)


def _unsharpened(image: Grey, sharpening: Sharpening | None, around: Array) -> Grey | Light:
    return image if sharpening is None else without_sharpening(decoded(image, 1.0), sharpening, around)
