"""From the fine grid around the raised circle to pixels: a motion in a straight line, a gaussian blur, samples."""

from __future__ import annotations

import numpy as np

from eposit.arrays import Array
from pipelines.detection.circle_numbers import Patch, Places
from pipelines.detection.kernels import compiled, compiled_part


def at_pixels(patch: Patch, fine: Array) -> Array:
    """(n,) values of a fine grid (h, w), blurred, at the pixels that take part."""
    moved = _smeared(fine, *patch.streak) if patch.streak else fine
    return _blurred(moved, patch.kernel, patch.finer, patch.rows, patch.columns)


@compiled
def _blurred(fine: Array, kernel: Array, finer: int, rows: Places, columns: Places) -> Array:
    """Separable blur of a fine grid (h, w), at the pixels (n,), (n,) of the patch. Beyond its border the grid goes on
    as it ends."""
    held = _blurred_along_y(fine, kernel, finer)
    taps, first = len(kernel), (finer - len(kernel)) // 2 + len(kernel)
    out = np.empty(len(rows))
    fours = len(rows) - len(rows) % 4
    # Four sums side by side, as each waits for its last product.
    for n in range(0, fours, 4):
        a, b, c, d = rows[n], rows[n + 1], rows[n + 2], rows[n + 3]
        e, f = finer * columns[n] + first, finer * columns[n + 1] + first
        g, h = finer * columns[n + 2] + first, finer * columns[n + 3] + first
        p, q, r, s = 0.0, 0.0, 0.0, 0.0
        for k in range(taps):
            share = kernel[k]
            p += share * held[a, e + k]
            q += share * held[b, f + k]
            r += share * held[c, g + k]
            s += share * held[d, h + k]
        out[n], out[n + 1], out[n + 2], out[n + 3] = p, q, r, s
    for n in range(fours, len(rows)):
        total = 0.0
        for k in range(taps):
            total += kernel[k] * held[rows[n], finer * columns[n] + first + k]
        out[n] = total
    return out


@compiled_part
def _blurred_along_y(fine: Array, kernel: Array, finer: int) -> Array:
    """(h / finer, w + 2 k) rows at the pixels' centres, with as many columns beyond either side as there are taps."""
    taps, (height, width) = len(kernel), fine.shape
    first, last = (finer - taps) // 2, height - 1
    held = np.empty((height // finer, width + 2 * taps))
    for i in range(held.shape[0]):
        for j in range(width):
            held[i, taps + j] = 0.0
        # Three taps at once, so that a sum is read and written once for them.
        for k in range(0, taps, 3):
            row = finer * i + first + k
            a, b, c = min(max(row, 0), last), min(max(row + 1, 0), last), min(max(row + 2, 0), last)
            p, q, r = kernel[k], kernel[k + 1] if k + 1 < taps else 0.0, kernel[k + 2] if k + 2 < taps else 0.0
            for j in range(width):
                held[i, taps + j] = held[i, taps + j] + p * fine[a, j] + q * fine[b, j] + r * fine[c, j]
        for j in range(taps):
            held[i, j], held[i, taps + width + j] = held[i, taps], held[i, taps + width - 1]
    return held


@compiled
def _smeared(fine: Array, shares: Array, shifts: Places) -> Array:
    """Sum of shares (k,) of a fine grid (h, w) that is shifted by (k, 2) columns and rows, both whole numbers.

    Beyond its border the grid goes on as it ends.
    """
    (height, width), count = fine.shape, len(shares)
    side = 0
    for n in range(count):
        side = max(side, abs(shifts[n, 0]))
    wide = _widened(fine, side)
    out = np.zeros((height, width))
    last, fours = height - 1, count - count % 4
    for i in range(height):
        own = out[i]
        # Four shares at once, so that a sum is read and written once for them.
        for n in range(0, fours, 4):
            p, q, r, s = shares[n], shares[n + 1], shares[n + 2], shares[n + 3]
            e, f, g, h = shifts[n, 0], shifts[n + 1, 0], shifts[n + 2, 0], shifts[n + 3, 0]
            a = wide[min(max(i + shifts[n, 1], 0), last), side + e : side + e + width]
            b = wide[min(max(i + shifts[n + 1, 1], 0), last), side + f : side + f + width]
            c = wide[min(max(i + shifts[n + 2, 1], 0), last), side + g : side + g + width]
            d = wide[min(max(i + shifts[n + 3, 1], 0), last), side + h : side + h + width]
            for j in range(width):
                own[j] = own[j] + p * a[j] + q * b[j] + r * c[j] + s * d[j]
        for n in range(fours, count):
            first = side + shifts[n, 0]
            line = wide[min(max(i + shifts[n, 1], 0), last), first : first + width]
            for j in range(width):
                own[j] += shares[n] * line[j]
    return out


@compiled_part
def _widened(fine: Array, side: int) -> Array:
    """(h, w + 2 side) a grid (h, w) that goes on to either side as it ends."""
    height, width = fine.shape
    wide = np.empty((height, width + 2 * side))
    for i in range(height):
        for j in range(side):
            wide[i, j], wide[i, side + width + j] = fine[i, 0], fine[i, width - 1]
        for j in range(width):
            wide[i, side + j] = fine[i, j]
    return wide


def prepare() -> None:
    """Call each compiled function once."""
    none, fine = np.zeros(0, np.intp), _smeared(np.ones((1, 1)), np.ones(1), np.zeros((1, 2), np.intp))
    _blurred(fine, np.ones(1), 1, none, none)
