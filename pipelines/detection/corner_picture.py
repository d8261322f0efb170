"""The picture of a chessboard corner: two crossing edges, blurred, under a light that has a slope.

grey = (m + c S) (1 + g . x), where S is the blurred product of the signs of the two sides. With signed distances d1
and d2 to the edges, a = d / sigma, and r the cosine between the edges' normals, S is the mean of sign(a1 + z1)
sign(a2 + z2) over two standard normals of correlation r, which to the third order in r is

    erf(a1 / sqrt 2) erf(a2 / sqrt 2) + r b1 b2 (1 + r a1 a2 / 2 + r^2 (a1^2 - 1) (a2^2 - 1) / 6),
    b = sqrt(2 / pi) exp(-a^2 / 2).

The edges are parabolas whose curvature is given: a lens bends lines, and a straight model would be pulled towards the
hollow side. The slope of the light shifts the blurred pattern by sigma^2 g.

Source:
    The series is Mehler's expansion of the bivariate normal distribution.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array
from pipelines.detection.erf import GAUSS, decay, signed_share
from pipelines.detection.kernels import inlined

# Numbers of a shape, in order: corner x, y, px from the start; directions of the two normals, rad; blur sigma, px;
# mean grey m, contrast c; slope of the light g, 1/px.
SHAPE = 9
BLUR, MEAN, CONTRAST, SLOPE = 4, 5, 6, 7


class CornerTask(NamedTuple):
    """What a fit of many corners is given; n corners in one image."""

    starts: Array  # (n, 2) px, where each is looked for
    shapes: Array  # (n, 9) to start from; without a mean grey (NaN), mean and contrast are worked out
    bends: Array  # (n, 2) curvatures of the edges towards their normals, 1/px
    inverses: Array  # (n, 2, 2) squares per px
    reaches: Array  # (n, 2) squares along both axes that a fit may use
    clears: Array  # (n,) squares; pixels farther than this from both lines see other print
    window: int  # px, likewise
    discs: Array  # (k, 2) centres, px, of ellipses to leave out
    disc_axes: Array  # (2, 2) from px to the unit circle of such an ellipse


class CornerPixels(NamedTuple):
    """Workspace: the pixels of one corner."""

    x: Array  # (m,) px from where the corner is looked for
    y: Array  # (m,)
    grey: Array  # (m,)
    residual: Array  # (m,) grey minus model
    jacobian: Array  # (9, m) change of the model for a change of the shape


@inlined
def gather(image: NDArray[np.uint8], task: CornerTask, i: int, pixels: CornerPixels) -> int:
    """Number of the pixels of corner i: within the window, its reach along both axes, and off the discs."""
    inverses, reaches, window, discs, disc_axes = task.inverses, task.reaches, task.window, task.discs, task.disc_axes
    clear = task.clears[i]
    x, y, grey = pixels.x, pixels.y, pixels.grey
    x0, y0 = task.starts[i, 0], task.starts[i, 1]
    n, left, top = 0, math.floor(x0 + 0.5), math.floor(y0 + 0.5)
    first_row, first_column = (top - window if top > window else 0), (left - window if left > window else 0)
    for row in range(first_row, top + window + 1):
        for column in range(first_column, left + window + 1):
            u, v = column - x0, row - y0
            across, down = inverses[i, 0, 0] * u + inverses[i, 0, 1] * v, inverses[i, 1, 0] * u + inverses[i, 1, 1] * v
            far = abs(across) > reaches[i, 0] or abs(down) > reaches[i, 1] or u * u + v * v > window * window
            far = far or (abs(across) > clear and abs(down) > clear)
            if far or row >= image.shape[0] or column >= image.shape[1]:
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
def draw(p: Array, n: int, bend1: float, bend2: float, pixels: CornerPixels) -> None:
    """Residual and jacobian of the shape p on n pixels, between edges of two curvatures."""
    x, y, grey, residual, jacobian = pixels
    c1, s1, c2, s2 = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    x0, y0, sigma, mean, contrast, gx, gy = p[0], p[1], p[4], p[5], p[6], p[7], p[8]
    r, per_sigma, variance = c1 * c2 + s1 * s2, 1.0 / sigma, sigma * sigma
    for i in range(n):
        u, v = x[i] - x0, y[i] - y0
        us, vs = u + variance * gx, v + variance * gy
        t1, t2 = c1 * vs - s1 * us, c2 * vs - s2 * us
        a1 = (c1 * us + s1 * vs - 0.5 * bend1 * (t1 * t1 + variance)) * per_sigma
        a2 = (c2 * us + s2 * vs - 0.5 * bend2 * (t2 * t2 + variance)) * per_sigma
        bell1, bell2 = decay(0.5 * a1 * a1), decay(0.5 * a2 * a2)
        e1, e2 = signed_share(a1, bell1), signed_share(a2, bell2)
        b1, b2 = GAUSS * bell1, GAUSS * bell2
        both = r * b1 * b2
        saddle = e1 * e2 + both * (1.0 + 0.5 * r * a1 * a2 + r * r / 6.0 * (a1 * a1 - 1.0) * (a2 * a2 - 1.0))
        light, level = 1.0 + gx * u + gy * v, mean + contrast * saddle
        lit = contrast * light * per_sigma
        d1, d2 = lit * (b1 * e2 - both * a1), lit * (b2 * e1 - both * a2)  # for a change of the distances
        jacobian[0, i] = -d1 * (c1 + bend1 * t1 * s1) - d2 * (c2 + bend2 * t2 * s2) - level * gx
        jacobian[1, i] = -d1 * (s1 - bend1 * t1 * c1) - d2 * (s2 - bend2 * t2 * c2) - level * gy
        jacobian[2, i] = d1 * t1
        jacobian[3, i] = d2 * t2
        jacobian[4, i] = -d1 * a1 - d2 * a2
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
