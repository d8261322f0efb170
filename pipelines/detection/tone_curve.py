"""The tone curve with which a camera encoded its picture, from the edges of a board, and the light before it.

A lens spreads light; the curve comes after it. One that lifts the dark part, as that of nearly every camera does, makes
white squares grow over black ones, by up to half a blur. A corner stays where it is, as its two white squares lie
opposite; but the raised circle shrinks, and more on the side that lies in the light than on that in its shade.

Print that runs makes black squares grow; that, and clipped white, is left alone. So is print that is too thin: it moves
edges and leaves them as they are, while a tone curve makes them lean.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray

from pipelines.detection.board_map import BoardMap
from pipelines.detection.corner_blur import edge_profiles, measured_blur
from pipelines.detection.corner_sites import CornerSites
from pipelines.detection.finders import Grey
from pipelines.spread import median_with_error

Light = NDArray[np.float32]  # (height, width) light, on the scale of grey values

EXPONENTS = np.linspace(1.0, 3.2, 12)  # of the curve grey = light^(1 / exponent) that are tried; sRGB is near 2.2
SURE = 4.0  # standard errors that the exponent must differ from 1
LEAST_EXPONENT = 1.1  # below it a correction is smaller than what else moves edges
LEAST_PROFILES = 8
LEAN = 0.03  # blurs by which a curve makes edges lean for each by which its exponent exceeds 1: a gaussian edge's
LEAST_LEAN, SURE_LEAN = 0.25, 2.0  # of that, less so many standard errors: samples half a pixel apart show a half of it


def decoded(image: Grey | Light, exponent: float) -> Light:
    """The light of a picture whose grey values are light^(1 / exponent), on their scale from 0 to 255."""
    if exponent == 1.0:
        return image.astype(np.float32)
    if image.dtype != np.uint8:
        return (255.0 * (image.astype(np.float32) / 255.0) ** exponent).astype(np.float32)
    curve = 255.0 * (np.arange(256) / 255.0) ** exponent
    return curve.astype(np.float32)[image.astype(np.uint8, copy=False)]


def measured_exponent(image: Grey, plain: Light, board: BoardMap, sites: CornerSites) -> float:
    """The exponent that makes black squares as large as white ones; 1 where they are so, or the larger ones.

    plain: the picture's light without a curve, `decoded(image, 1.0)`.
    """
    before, error = _growth(plain, board, sites)
    if not before < -SURE * error:
        return 1.0
    for low, high in itertools.pairwise(map(float, EXPONENTS)):
        after = _growth(decoded(image, high), board, sites)[0]
        if after >= 0.0:
            exponent = low + before / (before - after) * (high - low)
            return exponent if exponent >= LEAST_EXPONENT and _leans(plain, exponent, board, sites) else 1.0
        before = after
    return 1.0


def _growth(light: Light, board: BoardMap, sites: CornerSites) -> tuple[float, float]:
    """By how many px black squares reach beyond their edges, and the standard error of that.

    An error of the map cancels out: on both sides of a corner an edge has black on different sides.
    """
    profiles = edge_profiles(light, board, sites)
    if profiles is None or len(profiles.shares) < LEAST_PROFILES:
        return 0.0, np.inf
    half = 0.5 * (profiles.shares.shape[1] - 1)
    beyond = profiles.step_px * (half - np.sum(profiles.shares, axis=1) + 0.5)
    beyond = np.where(profiles.rises, beyond, -beyond)
    return median_with_error(beyond)


def _leans(plain: Light, exponent: float, board: BoardMap, sites: CornerSites) -> bool:
    """Whether edges lean as such a curve makes them: the mean of their grey values lies beside the middle one."""
    profiles = edge_profiles(plain, board, sites)
    if profiles is None:
        return False
    shares, rows = profiles.shares, np.arange(len(profiles.shares))
    after = np.clip(np.argmax(shares >= 0.5, axis=1), 1, shares.shape[1] - 1)
    low, high = shares[rows, after - 1], shares[rows, after]
    halfway = after - (high - 0.5) / np.maximum(high - low, 1e-9)
    mean = shares.shape[1] - 0.5 - np.sum(shares, axis=1)
    lean, error = median_with_error(profiles.step_px * np.where(profiles.rises, mean - halfway, halfway - mean))
    expected = LEAN * (exponent - 1.0) * measured_blur(plain, board, sites)
    return lean + SURE_LEAN * error > LEAST_LEAN * expected
