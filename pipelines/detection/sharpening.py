"""The sharpening that a camera adds to its pictures, from the edges of a board, and the picture before it.

Most cameras add to a picture a share of its difference to a blurred copy. An edge then goes beyond black and white on
both sides, which no blur does: a model of a blurred edge takes it for a sharper one in much noise. The filter that adds
has an inverse, which only makes noise less.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import cv2
import numpy as np
from scipy.optimize import least_squares
from scipy.special import ndtr

from eposit.arrays import Array
from pipelines.detection.board_map import BoardMap
from pipelines.detection.corner_blur import LIMITS_PX, SAMPLING, EdgeProfiles, edge_profiles, widths_beyond
from pipelines.detection.corner_sites import CornerSites
from pipelines.detection.tone_curve import Light
from pipelines.spread import median_with_error

NARROWER = 0.15  # px by which edges along both axes must be narrower than their slopes say: noise in ordinary pictures
# shows 0.1
AMOUNTS, COPIES_PX = (0.0, 4.0), (0.5, 6.0)  # what cameras and their users set
START = 0.5, 1.0
NEAR_BLURS, NEAR_PX = 6.0, 2.0  # of the middle of an edge: what is fitted
OUTLIERS = 0.03  # of black to white: noise and JPEG change less
OVERSHOOT, SURE = 0.015, 3.0  # of black to white: what a sharpened edge goes beyond, less so many standard errors;
# JPEG shows 0.011, and noise less than these errors
BINS_PX = np.arange(0.5, 8.5, 0.5)  # from an edge, in which this is looked for
LEAST_SAMPLES = 20  # in one
KERNEL_PX, KERNEL_COPIES = 4, 4.0  # to each side: px, and copies' blurs; up to a fifteenth of a filter lies beyond
TRANSFORM = 128  # samples of a filter's transform along each axis
BEYOND = 0.35  # of the extent of the board's corners: what lies around them is put back, too


class Sharpening(NamedTuple):
    """What was added to a picture."""

    amount: float  # of the difference to a blurred copy
    px: float  # standard deviation of that copy's blur


def measured_sharpening(image: Light, board: BoardMap, sites: CornerSites, blur_px: float) -> Sharpening | None:
    """The sharpening of a picture; None if its edges are those of a blur.

    blur_px: of the edges by their slopes, the pixels' own area included.
    """
    if not np.all(widths_beyond(image, board, sites, blur_px) < -NARROWER):
        return None
    profiles = edge_profiles(image, board, sites)
    return None if profiles is None else _fitted(profiles, blur_px)


def _fitted(profiles: EdgeProfiles, blur_px: float) -> Sharpening | None:
    """Least squares of all profiles, each about its own middle; None if they do not go beyond black and white."""
    samples = profiles.shares.shape[1]
    middle = samples - np.sum(profiles.shares, axis=1) - 0.5  # where an edge with two like sides is half way
    away = (np.arange(samples) - middle[:, None]) * profiles.step_px[:, None]
    if _overshoot(away, profiles.shares) < OVERSHOOT:
        return None
    near = np.abs(away) < NEAR_BLURS * blur_px + NEAR_PX
    x, share = away[near], profiles.shares[near]

    def left(numbers: Array) -> Array:
        blur, amount, copy = numbers
        variance = blur**2 + SAMPLING
        return _edge(x, variance) * (1.0 + amount) - amount * _edge(x, variance + copy**2) - share

    low, high = zip(LIMITS_PX, AMOUNTS, COPIES_PX, strict=True)
    start = np.clip((blur_px, *START), np.array(low) + 0.01, np.array(high) - 0.01)
    fit = least_squares(left, start, bounds=(low, high), loss="soft_l1", f_scale=OUTLIERS)
    return Sharpening(float(fit.x[1]), float(fit.x[2]))


def _overshoot(away: Array, shares: Array) -> float:
    """How far edges surely go beyond black and white, as a share of their difference. away: (k, s) px from each."""
    distance, beyond = np.abs(away), np.where(away > 0.0, shares, 1.0 - shares) - 1.0
    found = [0.0]
    for near, far in itertools.pairwise(BINS_PX):
        values = beyond[(distance >= near) & (distance < far)]
        if len(values) >= LEAST_SAMPLES:
            middle, error = median_with_error(values)
            found.append(middle - SURE * error)
    return max(found)


def _edge(x: Array, variance: float) -> Array:
    """Share of white at distances x, px, from an edge that is blurred with a variance, px^2."""
    return ndtr(x / math.sqrt(variance))


def without_sharpening(image: Light, sharpening: Sharpening, around: Array) -> Light:
    """A picture before it was sharpened, where the board is; elsewhere it stays.

    around: (n, 2) px, places of the board.
    """
    height, width = image.shape
    around = around[np.all((around >= 0.0) & (around < (width, height)), axis=1)]
    if not len(around):
        return image.copy()
    filter_ = _inverse_filter(sharpening)
    margin = len(filter_) + BEYOND * np.ptp(around, axis=0).max()
    x0, y0 = np.clip(np.floor(around.min(axis=0) - margin), 0, (width, height)).astype(int)
    x1, y1 = np.clip(np.ceil(around.max(axis=0) + margin), 0, (width, height)).astype(int)
    part, out = image[y0:y1, x0:x1], image.copy()
    before = cv2.filter2D(part, cv2.CV_32F, filter_, borderType=cv2.BORDER_REFLECT_101)
    out[y0:y1, x0:x1] = np.clip(before, 0.0, 255.0)
    return out


def _inverse_filter(sharpening: Sharpening) -> Light:
    """The filter that takes a sharpening back: its transform is one over that of what was added."""
    frequency = 2.0 * np.pi * np.fft.fftfreq(TRANSFORM)
    copy = np.exp(-0.5 * sharpening.px**2 * (frequency[:, None] ** 2 + frequency**2))
    kernel = np.fft.fftshift(np.fft.ifft2(1.0 / (1.0 + sharpening.amount * (1.0 - copy))).real)
    reach = KERNEL_PX + math.ceil(KERNEL_COPIES * sharpening.px)
    middle = slice(TRANSFORM // 2 - reach, TRANSFORM // 2 + reach + 1)
    kernel = kernel[middle, middle]
    return (kernel / kernel.sum()).astype(np.float32)
