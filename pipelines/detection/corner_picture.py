"""The picture of a chessboard corner: two crossing edges, blurred, under a light that has a slope.

grey = (m + c S) (1 + g . x), where S is the blurred product of the signs of the two sides. With signed distances d1
and d2 to the edges, a = d / sigma, and r the cosine between the edges' normals, S is the mean of sign(a1 + z1)
sign(a2 + z2) over two standard normals of correlation r, which to the third order in r is

    erf(a1 / sqrt 2) erf(a2 / sqrt 2) + r b1 b2 (1 + r a1 a2 / 2 + r^2 (a1^2 - 1) (a2^2 - 1) / 6),
    b = sqrt(2 / pi) exp(-a^2 / 2).

The edges are curves whose shape is given: a lens bends lines, and a straight model would be pulled towards the hollow
side. The slope of the light shifts the blurred pattern by sigma^2 g. Where the picture is so sharp that a pixel's own
area is most of the blur, the pattern of each edge is averaged over that area (`corner_profiles`).

Source:
    The series is Mehler's expansion of the bivariate normal distribution.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array, Mask
from pipelines.detection.corner_profiles import EdgeProfile, box_profile, gaussian_profile, place_edge
from pipelines.detection.kernels import inlined

# Numbers of a shape, in order: corner x, y, px from the start; directions of the two normals, rad; blur sigma, px;
# mean grey m, contrast c; slope of the light g, 1/px.
SHAPE = 9
BLUR, MEAN, CONTRAST, SLOPE = 4, 5, 6, 7


class CornerTask(NamedTuple):
    """What a fit of many corners is given; n corners in one image."""

    starts: Array  # (n, 2) px, where each is looked for
    shapes: Array  # (n, 9) to start from; without a mean grey (NaN), mean and contrast are worked out
    edges: Array  # (n, 2, 3) coefficients of t^2, t^3, t^4 of each edge's distance from its tangent, towards its normal
    sharp: Mask  # (n,) whether a pixel's area is most of the blur
    inverses: Array  # (n, 2, 2) squares per px
    reaches: Array  # (n, 2) squares along both axes that a fit may use
    clears: Array  # (n,) squares; pixels farther than this from both lines see other print
    windows: NDArray[np.int64]  # (n,) px, likewise
    bands: Array  # (n,) px to either side of an edge, likewise
    discs: Array  # (k, 2) centres, px, of ellipses to leave out
    disc_axes: Array  # (2, 2) from px to the unit circle of such an ellipse


class CornerPixels(NamedTuple):
    """Workspace: the pixels of one corner."""

    x: Array  # (m,) px from where the corner is looked for
    y: Array  # (m,)
    grey: Array  # (m,)
    residual: Array  # (m,) grey minus model
    jacobian: Array  # (9, m) change of the model for a change of the shape
    first: EdgeProfile
    second: EdgeProfile


@inlined
def gather(image: NDArray[np.float32], task: CornerTask, i: int, pixels: CornerPixels) -> int:
    """Number of the pixels of corner i: within the window, its reach along both axes, beside an edge, off the discs."""
    inverses, reaches, discs, disc_axes = task.inverses, task.reaches, task.discs, task.disc_axes
    clear, window, band = task.clears[i], task.windows[i], task.bands[i]
    x, y, grey = pixels.x, pixels.y, pixels.grey
    x0, y0 = task.starts[i, 0], task.starts[i, 1]
    c1, s1, c2, s2 = (
        math.cos(task.shapes[i, 2]), math.sin(task.shapes[i, 2]),
        math.cos(task.shapes[i, 3]), math.sin(task.shapes[i, 3]),
    )  # fmt: skip
    bend1, bend2 = task.edges[i, 0, 0], task.edges[i, 1, 0]
    n, left, top = 0, math.floor(x0 + 0.5), math.floor(y0 + 0.5)
    first_row, first_column = (top - window if top > window else 0), (left - window if left > window else 0)
    last_row, last_column = min(top + window, image.shape[0] - 1), min(left + window, image.shape[1] - 1)
    for row in range(first_row, last_row + 1):
        v = row - y0
        for column in range(first_column, last_column + 1):
            u = column - x0
            t1, t2 = c1 * v - s1 * u, c2 * v - s2 * u
            if abs(c1 * u + s1 * v - bend1 * t1 * t1) > band and abs(c2 * u + s2 * v - bend2 * t2 * t2) > band:
                continue
            across, down = inverses[i, 0, 0] * u + inverses[i, 0, 1] * v, inverses[i, 1, 0] * u + inverses[i, 1, 1] * v
            far = abs(across) > reaches[i, 0] or abs(down) > reaches[i, 1] or u * u + v * v > window * window
            if far or (abs(across) > clear and abs(down) > clear):
                continue
            covered = False
            for k in range(len(discs)):
                du, dv = column - discs[k, 0], row - discs[k, 1]
                p = disc_axes[0, 0] * du + disc_axes[0, 1] * dv
                q = disc_axes[1, 0] * du + disc_axes[1, 1] * dv
                covered = covered or p * p + q * q < 1.0
            if not covered:
                x[n], y[n], grey[n] = u, v, image[row, column]
                n += 1
    return n


@inlined
def draw(p: Array, n: int, edges: Array, sharp: bool, pixels: CornerPixels) -> None:
    """Residual and jacobian of the shape p on n pixels, between edges (2, 3) of given form."""
    x, y, grey, residual, jacobian, one, two = pixels
    c1, s1, c2, s2 = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    x0, y0, sigma, mean, contrast, gx, gy = p[0], p[1], p[4], p[5], p[6], p[7], p[8]
    r, per_sigma, variance = c1 * c2 + s1 * s2, 1.0 / sigma, sigma * sigma
    shifted = x0 - variance * gx, y0 - variance * gy
    place_edge(x, y, n, shifted, (c1, s1), sigma, edges[0], one)
    place_edge(x, y, n, shifted, (c2, s2), sigma, edges[1], two)
    if sharp:
        box_profile(n, sigma, (c1, s1), one)
        box_profile(n, sigma, (c2, s2), two)
    else:
        gaussian_profile(n, sigma, one)
        gaussian_profile(n, sigma, two)
    for i in range(n):
        u, v = x[i] - x0, y[i] - y0
        a1, a2, e1, e2 = one.distance[i], two.distance[i], one.sign[i], two.sign[i]
        b1, b2 = one.slope[i] * sigma, two.slope[i] * sigma
        both = r * b1 * b2
        saddle = e1 * e2 + both * (1.0 + 0.5 * r * a1 * a2 + r * r / 6.0 * (a1 * a1 - 1.0) * (a2 * a2 - 1.0))
        light, level = 1.0 + gx * u + gy * v, mean + contrast * saddle
        lit = contrast * light * per_sigma
        d1, d2 = lit * (b1 * e2 - both * a1), lit * (b2 * e1 - both * a2)  # for a change of the distances
        jacobian[0, i] = -d1 * (c1 + one.bend[i] * s1) - d2 * (c2 + two.bend[i] * s2) - level * gx
        jacobian[1, i] = -d1 * (s1 - one.bend[i] * c1) - d2 * (s2 - two.bend[i] * c2) - level * gy
        jacobian[2, i] = d1 * one.along[i]
        jacobian[3, i] = d2 * two.along[i]
        jacobian[4, i] = lit * (sigma * (one.widening[i] * e2 + two.widening[i] * e1) + both * (a1 * a1 + a2 * a2))
        jacobian[5, i] = light
        jacobian[6, i] = saddle * light
        jacobian[7, i] = level * u
        jacobian[8, i] = level * v
        residual[i] = grey[i] - level * light


@inlined
def start_levels(saddle: Array, grey: Array, n: int, p: Array) -> None:
    """Mean and contrast of the shape p by linear regression of the grey values on the saddle."""
    middle, level = 0.0, 0.0
    for i in range(n):
        middle += saddle[i] / n
        level += grey[i] / n
    above, square = 0.0, 0.0
    for i in range(n):
        above += (saddle[i] - middle) * (grey[i] - level)
        square += (saddle[i] - middle) ** 2
    p[CONTRAST] = above / (square + 1e-12)
    p[MEAN] = level - p[CONTRAST] * middle
