"""Pictures from a function of the place, by brute force: many cells to a pixel, blurred and averaged.

Nothing here is shared with the detection or the renderer, so that a mistake of theirs cannot cancel.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import gaussian_filter

FINER = 10  # cells to a pixel along each side


def picture(grey, width, height, blur_px, finer=FINER):
    """(height, width) mean over each pixel of `grey(x, y)`, blurred before by a gaussian.

    grey: a function of px, pixel centres at integers, that takes and gives (rows, columns) arrays. Around the picture
    as much is drawn as the blur reaches, so that the picture's border is like any other place.
    """
    around = int(np.ceil(5.0 * blur_px))
    x, y = ((np.arange((n + 2 * around) * finer) + 0.5) / finer - 0.5 - around for n in (width, height))
    fine = gaussian_filter(grey(*np.meshgrid(x, y)), blur_px * finer, truncate=5.0, mode="nearest")
    whole = fine.reshape(height + 2 * around, finer, width + 2 * around, finer).mean(axis=(1, 3))
    return whole[around : around + height, around : around + width]


def side(distance_px, finer=FINER):
    """-1 on one side of a line and 1 on the other; a cell on the line has the mean of both.

    Without it the line would lie anywhere within a cell, a tenth of a pixel.
    """
    return np.clip(2.0 * distance_px * finer, -1.0, 1.0)


def digitised(grey, rng, noise):
    """8 bits of a picture with gaussian noise, in grey values."""
    return np.clip(np.rint(grey + noise * rng.standard_normal(grey.shape)), 0, 255).astype(np.uint8)
