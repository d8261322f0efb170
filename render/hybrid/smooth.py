"""Noise of a baked map averaged away where light is smooth, and left where it is not."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array

WIDTHS = (1.0, 2.0, 4.0)  # standard deviations of the averages, in texels
NARROW = WIDTHS[:1]
SIGNIFICANT = 3.0  # standard errors by which an average may differ from finer ones
NOISE_WIDTH = 1.5  # texels
SUPPORT = 3  # of the nine texels around one that must differ, too: a stray bright path does so alone
REACH = 3.0  # standard deviations where a gaussian is cut off


def smoothed(values: Array, variance: Array, widths: tuple[float, ...] = WIDTHS) -> Array:
    """(rows, columns, channels) map, each texel averaged as widely as its surroundings allow.

    variance: of the noise of each texel, same shape. A texel takes the widest gaussian whose average differs by no more
    than its noise explains from every narrower one: a shadow's edge stops the widening.
    Source:
        Lepski (1991): choosing a bandwidth by comparing estimates with their deviations.
    """
    kept = values.copy()
    open_ = np.ones(values.shape[:2], bool)
    finer = [(values, variance)]
    for width in widths:
        wide, noise2 = _gaussian(values, width), _gaussian(variance, width) / (4.0 * np.pi * width * width)
        for value, own2 in finer:
            differs = np.any(np.abs(wide - value) > SIGNIFICANT * np.sqrt(own2 + noise2), axis=2)
            open_ &= ~(differs & (_neighbours(differs) >= SUPPORT))
        finer.append((wide, noise2))
        kept[open_] = wide[open_]
    return kept


def _neighbours(mask: NDArray[np.bool_]) -> NDArray[np.int_]:
    """How many of the nine texels around each are set, itself among them."""
    padded = np.pad(mask.astype(int), 1)
    rows = padded[:-2] + padded[1:-1] + padded[2:]
    return rows[:, :-2] + rows[:, 1:-1] + rows[:, 2:]


def noise(halves: Array) -> Array:
    """(rows, columns, channels) variance of the mean of two independent halves (2, rows, columns, channels).

    It is averaged over some ten texels: a single difference says little.
    """
    return _gaussian(0.25 * (halves[0] - halves[1]) ** 2, NOISE_WIDTH)


def _gaussian(values: Array, width: float) -> Array:
    """Average over neighbours with gaussian weights; at the border over those that are there."""
    return _along_rows(_along_rows(values, width).swapaxes(0, 1), width).swapaxes(0, 1)


def _along_rows(values: Array, width: float) -> Array:
    reach = int(np.ceil(REACH * width))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) / width) ** 2)
    there: NDArray[np.float64] = np.convolve(np.ones(values.shape[0]), kernel)[reach:-reach]
    total = np.zeros_like(values)
    count = values.shape[0]
    for offset, weight in zip(range(-reach, reach + 1), kernel, strict=True):
        low, high = max(0, -offset), min(count, count - offset)
        if low < high:
            total[low:high] += weight * values[low + offset : high + offset]
    return total / there[:, None, None]
