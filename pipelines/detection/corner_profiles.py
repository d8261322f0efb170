"""How grey changes across one edge of a chessboard's corner, seen through a blur and through the pixels' own area.

Each profile fills, for the pixels of one corner, what `corner_picture` puts together: the blurred sign E of the side on
which a pixel lies, its change for a change of the distance to the edge, and for a change of the blur.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from eposit.arrays import Array
from pipelines.detection.erf import GAUSS, decay, signed_share
from pipelines.detection.kernels import compiled_part

PIXEL = 1.0 / 12.0  # variance of a pixel's area along any direction, px^2
LEAST_GAUSSIAN = 4e-3  # variance of the gaussian that is left when the pixel's area is taken away, px^2
NARROW = 0.02  # a pixel's area that is narrower than this along one of its sides counts as a box of one side


class EdgeProfile(NamedTuple):
    """Workspace: one edge at the pixels of a corner."""

    distance: Array  # (m,) signed distance to the edge over the blur
    along: Array  # (m,) px along the edge, from the corner
    bend: Array  # (m,) slope of the edge against its tangent at the corner
    sign: Array  # (m,) blurred sign of the side, -1 to 1
    slope: Array  # (m,) its change for a change of the distance, 1/px
    widening: Array  # (m,) its change for a change of the blur, 1/px


@compiled_part
def place_edge(
    x: Array, y: Array, n: int, corner: tuple[float, float], normal: tuple[float, float], sigma: float, edge: Array,
    profile: EdgeProfile,
) -> None:  # fmt: skip
    """Distances of n pixels to an edge through a corner, and what follows from them.

    corner: px. normal: unit vector. edge: (3,) coefficients of t^2, t^3, t^4 of its distance from its tangent, towards
    the normal, for t px along it.
    """
    distance, along, bend = profile.distance, profile.along, profile.bend
    c, s = normal
    x0, y0 = corner
    k2, k3, k4, per_sigma = edge[0], edge[1], edge[2], 1.0 / sigma
    for i in range(n):
        u, v = x[i] - x0, y[i] - y0
        t = c * v - s * u
        hollow = t * t * (k2 + t * (k3 + t * k4)) + k2 * sigma * sigma  # blur widens a bent edge to its hollow side
        distance[i] = (c * u + s * v - hollow) * per_sigma
        along[i] = t
        bend[i] = t * (2.0 * k2 + t * (3.0 * k3 + t * 4.0 * k4))


@compiled_part
def gaussian_profile(n: int, sigma: float, profile: EdgeProfile) -> None:
    """An edge under a blur so wide that a pixel's area only adds to its variance."""
    distance, sign, slope, widening = profile.distance, profile.sign, profile.slope, profile.widening
    per_sigma = 1.0 / sigma
    for i in range(n):
        a = distance[i]
        bell = decay(0.5 * a * a)
        sign[i] = signed_share(a, bell)
        slope[i] = GAUSS * bell * per_sigma
        widening[i] = -slope[i] * a


@compiled_part
def box_profile(n: int, sigma: float, normal: tuple[float, float], profile: EdgeProfile) -> None:
    """An edge under a narrow blur, averaged over each pixel's area.

    Seen along the edge, a pixel is the convolution of two boxes as wide as the components of the normal. So the profile
    is a second difference of the second antiderivative of the gaussian's error function.
    """
    distance, sign, slope, widening = profile.distance, profile.sign, profile.slope, profile.widening
    wide, narrow = abs(normal[0]), abs(normal[1])
    if wide < narrow:
        wide, narrow = narrow, wide
    left = sigma * sigma - PIXEL
    if narrow < NARROW:
        left += narrow * narrow / 12.0
    gaussian = math.sqrt(left if left > LEAST_GAUSSIAN else LEAST_GAUSSIAN)
    for i in range(n):
        d, total, first, second = distance[i] * sigma, 0.0, 0.0, 0.0
        for k in range(4):
            if narrow < NARROW and k % 2 == 1:
                continue
            far = 0.5 * wide if k < 2 else -0.5 * wide
            near = 0.0 if narrow < NARROW else 0.5 * narrow if k % 2 == 0 else -0.5 * narrow
            x, plus = d + far + near, 1.0 if (k < 2) == (k % 2 == 0) else -1.0
            a = x / gaussian
            bell = decay(0.5 * a * a)
            error, hill = signed_share(a, bell), GAUSS * gaussian * bell
            if narrow < NARROW:
                plus = 1.0 if k < 2 else -1.0
                total += plus * (x * error + hill)
                first += plus * error
                second += plus * hill / (gaussian * gaussian)
            else:
                total += plus * 0.5 * ((x * x + gaussian * gaussian) * error + x * hill)
                first += plus * (x * error + hill)
                second += plus * error
        area = wide if narrow < NARROW else wide * narrow
        sign[i], slope[i], widening[i] = total / area, first / area, sigma * second / area
