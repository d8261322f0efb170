"""Kinds of pictures that several things spoil at once, as real ones are."""

import cv2
import numpy as np
from scipy.ndimage import gaussian_filter

from tests.stress import cameras as make
from tests.stress import surroundings as around
from tests.stress.boards import Board
from tests.stress.cameras import camera
from tests.stress.drawing import Spread
from tests.stress.kind import Kind
from tests.stress.views import Framing


def _grain(amount, sigma):
    """Noise of so many grey values, blurred by sigma px."""

    def after(image, rng):
        noise = gaussian_filter(rng.standard_normal(image.shape), sigma)
        return np.clip(np.rint(image + amount * noise / noise.std()), 0, 255).astype(np.uint8)

    return after


def _shrunk(scale):
    """A picture made smaller, each pixel the mean of what it covers."""
    return lambda image, rng: cv2.resize(image, None, fx=1.0 / scale, fy=1.0 / scale, interpolation=cv2.INTER_AREA)


def _resized(scale):
    """Of the truth: pixel centres stay on the same side of each other."""
    return lambda points: scale * (points + 0.5) - 0.5


KINDS = (
    Kind("correlated-noise", "noise of 4 grey values that is blurred by 1 px, as denoised pictures have it",
         camera=camera(after=_grain(4.0, 1.0))),
    Kind("mosaic-noise", "a Bayer mosaic, noise of 4", camera=camera(noise=4.0, after=make.mosaic)),
    Kind("low-contrast-jpeg", "black at 3/4 of white, JPEG of quality 70", board=Board(print_grey=0.6),
         camera=camera(gain=150.0, after=make.jpeg(70))),
    Kind("blur-jpeg-gradient", "blur 1.5 px, light that falls by 1 to 5, JPEG of quality 80",
         spread=Spread(gaussian=1.5), light=around.gradient(5.0), camera=camera(after=make.jpeg(80))),
    Kind("denoised", "noise of 8, median of 3 x 3 pixels, sharpened, JPEG of quality 85",
         camera=camera(noise=8.0, after=make.in_turn(make.median(3), make.unsharp(0.8, 1.2), make.jpeg(85)))),
    Kind("shrunk", "noise of 8, shrunk by 1.5", framing=Framing(width=1200, height=900), spread=Spread(gaussian=1.0),
         camera=camera(noise=8.0, after=_shrunk(1.5)), shift=_resized(1.0 / 1.5)),
    Kind("enlarged-noise", "a picture of half the size, noise of 4, enlarged",
         framing=Framing(width=400, height=300, least=0.7),
         camera=camera(noise=4.0, after=make.enlarged(2)), shift=_resized(2.0)),
)  # fmt: skip
