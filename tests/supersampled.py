"""Pictures from a function of the place, by brute force: many cells to a pixel, blurred and averaged.

Nothing here is shared with the detection or the renderer, so that a mistake of theirs cannot cancel.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

FINER = 10  # cells to a pixel along each side


def picture(grey, width, height, blur_px, finer=FINER):
    """(height, width) mean over each pixel of `grey(x, y)`, blurred before by a gaussian.

    grey: a function of px, pixel centres at integers, that takes and gives (rows, columns) arrays. Around the picture
    as much is drawn as the blur reaches, so that the picture's border is like any other place.
    """
    around = int(np.ceil(5.0 * blur_px))
    x, y = ((np.arange((n + 2 * around) * finer) + 0.5) / finer - 0.5 - around for n in (width, height))
    along, across = (_means(n, around, blur_px * finer, finer) for n in (height, width))
    return along @ grey(*np.meshgrid(x, y)) @ across.T


def _means(pixels, around, sigma, finer):
    """Sparse (pixels, cells): the mean of a pixel's cells, each of them blurred by a gaussian cut at 5 sigma."""
    reach = int(5.0 * sigma + 0.5)
    weights = np.exp(-0.5 * (np.arange(-reach, reach + 1) / sigma) ** 2) if sigma else np.ones(1)
    weights = np.convolve(weights / weights.sum(), np.full(finer, 1.0 / finer))
    first = finer * (around + np.arange(pixels)) - reach
    columns = first[:, None] + np.arange(len(weights))
    rows = np.repeat(np.arange(pixels), len(weights))
    return csr_array((np.tile(weights, pixels), (rows, columns.ravel())), (pixels, finer * (pixels + 2 * around)))


def side(distance_px, finer=FINER):
    """-1 on one side of a line and 1 on the other; a cell on the line has the mean of both.

    Without it the line would lie anywhere within a cell, a tenth of a pixel.
    """
    return np.clip(2.0 * distance_px * finer, -1.0, 1.0)


def digitised(grey, rng, noise):
    """8 bits of a picture with gaussian noise, in grey values."""
    return np.clip(np.rint(grey + noise * rng.standard_normal(grey.shape)), 0, 255).astype(np.uint8)
