"""The picture of a chessboard corner that the edge of a shadow crosses, for the few corners that have one.

The print is a product of two signs, the light one of two levels on either side of a third curve; both are drawn on
cells finer than the blur and the light between, and carried to the pixels by the blur and the pixels' own area. So the
curves may lie in any way to each other, one upon another, too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.special import erf, ndtr

from eposit.arrays import Array, Mask
from pipelines.detection.corner_profiles import LEAST_GAUSSIAN, PIXEL

# Numbers of a shape, in order: corner x, y, px from where it is looked for; directions of the two normals, rad; blur
# sigma, px; of the shadow's edge: distance from there, px, direction of its normal, rad, bend, 1/px, and sigma of its
# own softness, px.
SHAPE = 9
LEVELS = 8  # numbers of which grey values are a linear function, see `bases`
BLUR, OFFSET, TURN, BEND, SOFT = 4, 5, 6, 7, 8
CELLS = 3.0  # to a blur
FINEST = 4.0  # cells to a pixel at most
BEYOND = 3.0  # blurs around the pixels from which light comes


class Patch(NamedTuple):
    """The pixels around one corner, in px from where it is looked for, and the curves of its edges."""

    x: Array  # (w,)
    y: Array  # (h,)
    used: Mask  # (h, w)
    edges: Array  # (2, 3) coefficients of t^2, t^3, t^4 of each edge's distance from its tangent
    grey: Array  # (n,) of the pixels that are used


def bases(p: Array, patch: Patch) -> Array:
    """(8, n) of which grey values are a sum: one, the print, both in the light alone, and both with slopes.

    p: (9,) shape.
    """
    cell = max(p[BLUR] / CELLS, 1.0 / FINEST)
    (x, from_x), (y, from_y) = (_cells(part, p[BLUR], cell) for part in (patch.x, patch.y))
    u, v = x - p[0], y[:, None] - p[1]
    first, second = (_sign(u, v, p[2 + k], patch.edges[k], cell) for k in range(2))
    c, s = math.cos(p[TURN]), math.sin(p[TURN])
    along = c * y[:, None] - s * x
    away = c * x + s * y[:, None] - p[OFFSET] - p[BEND] * along**2
    light = erf(away / math.sqrt(2.0 * p[SOFT] ** 2 + 0.1 * cell**2)) * 0.5 + 0.5  # no sharper than cells can show
    pattern = first * second
    seen = [(from_y @ part @ from_x.T)[patch.used] for part in (pattern, light, pattern * light)]
    across, down = (np.broadcast_to(part, patch.used.shape)[patch.used] for part in (patch.x, patch.y[:, None]))
    one = np.ones(len(across))
    return np.stack([one, seen[0], seen[1], seen[2], across, down, across * seen[0], down * seen[0]])


def _cells(pixels: Array, blur: float, cell: float) -> tuple[Array, Array]:
    """Middles (m,) of cells along an axis, px, and what pixels (k,) have of each of them, (k, m)."""
    most = BEYOND * blur + 1.0
    count = math.ceil((pixels[-1] - pixels[0] + 2.0 * most) / cell)
    middle = 0.5 * (pixels[0] + pixels[-1])
    cells = middle + (np.arange(count) - 0.5 * (count - 1)) * cell
    away = pixels[:, None] - cells
    sigma = math.sqrt(max(blur**2 - PIXEL, LEAST_GAUSSIAN))
    share = ndtr((away + 0.5) / sigma) - ndtr((away - 0.5) / sigma)
    return cells, share / share.sum(axis=1)[:, None]


def _sign(u: Array, v: Array, angle: float, edge: Array, cell: float) -> Array:
    """(k, m) side of an edge on which cells lie, -1 to 1, the mean of those that it crosses."""
    c, s = math.cos(angle), math.sin(angle)
    t = c * v - s * u
    away = c * u + s * v - t * t * (edge[0] + t * (edge[1] + t * edge[2]))
    return np.clip(away * (2.0 / ((abs(c) + abs(s)) * cell)), -1.0, 1.0)
