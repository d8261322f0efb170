"""From the fine grid around the raised circle to pixels: a motion in a straight line, a gaussian blur, samples."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.detection.circle_numbers import Patch, Places
from pipelines.detection.kernels import compiled


def at_pixels(patch: Patch, fine: Array) -> Array:
    """(n,) values of a fine grid (h, w), blurred, at the pixels that take part."""
    moved = _smeared(fine, *patch.streak) if patch.streak else fine
    return _blurred(moved, patch.kernel, patch.finer, patch.rows, patch.columns)


@compiled
def _blurred(fine: Array, kernel: Array, finer: int, rows: Places, columns: Places) -> Array:
    """Separable blur of a fine grid (h, w), at the pixels (n,), (n,) of the patch. Beyond its border the grid goes on
    as it ends."""
    taps, (height, width) = len(kernel), fine.shape
    first = (finer - taps) // 2
    held = np.empty((height // finer, width + 2 * taps))
    for i in range(held.shape[0]):
        for j in range(width):
            held[i, taps + j] = 0.0
        for k in range(taps):
            row = finer * i + first + k
            row = 0 if row < 0 else height - 1 if row >= height else row
            for j in range(width):
                held[i, taps + j] += kernel[k] * fine[row, j]
        for j in range(taps):
            held[i, j], held[i, taps + width + j] = held[i, taps], held[i, taps + width - 1]
    out = np.empty(len(rows))
    for n in range(len(rows)):
        begin, total = finer * columns[n] + first + taps, 0.0
        for k in range(taps):
            total += kernel[k] * held[rows[n], begin + k]
        out[n] = total
    return out


@compiled
def _smeared(fine: Array, shares: Array, shifts: Places) -> Array:
    """Sum of shares (k,) of a fine grid (h, w) that is shifted by (k, 2) columns and rows, both whole numbers.

    Beyond its border the grid goes on as it ends.
    """
    height, width = fine.shape
    out = np.zeros((height, width))
    for n in range(len(shares)):
        across, down = shifts[n]
        first, last = min(max(-across, 0), width), max(min(width - across, width), 0)
        for i in range(height):
            row = 0 if i + down < 0 else height - 1 if i + down >= height else i + down
            line, own = fine[row, first + across : last + across], out[i, first:last]
            for j in range(first):
                out[i, j] += shares[n] * fine[row, 0]
            for j in range(len(own)):
                own[j] += shares[n] * line[j]
            for j in range(last, width):
                out[i, j] += shares[n] * fine[row, width - 1]
    return out


def prepare() -> None:
    """Call each compiled function once."""
    none, fine = np.zeros(0, np.intp), _smeared(np.ones((1, 1)), np.ones(1), np.zeros((1, 2), np.intp))
    _blurred(fine, np.ones(1), 1, none, none)
