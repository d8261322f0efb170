"""The numbers of a circle's fit, what is known of them beforehand, and the pixels that it reads."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from eposit.arrays import Array

Places = NDArray[np.intp]
# Numbers of a fit: disc x, y, in radii from where it is expected, its size as a ratio, and by how much it is longer
# along x than along y and along one diagonal than along the other, as shares; shadow x, y from the foot and the
# softness of its rim, in radii; then k, w, gx, gy, hx, hy (per radius), A, L, R in grey values; then m more L.
SHAPE, LINEAR = 8, 9
SIZE, OBLONG, SHADOW, SOFTNESS = 2, slice(3, 5), slice(5, 7), 7
DISC_GREY, WHITE_GREY, WHITE_SLOPE, DISC_SLOPE = 8, 9, slice(10, 12), slice(12, 14)
BLOCKED, LAMP, RIM, FURTHER = 14, 15, 16, 17


@dataclass(frozen=True, slots=True)
class Patch:
    """A part of the image around the circle, and the fine grid over it in radii of the circle."""

    grey: Array  # (n,) grey values of the pixels that take part
    rows: Places  # (n,) of these pixels
    columns: Places  # (n,)
    on_board: Array  # (2, h, w) places of the fine grid on the board, from the circle's foot
    on_disc: Array  # (2, h, w) places on the circle's plane, from its centre
    slope_x: Array  # (1, w) the white's slope along x for a slope of one grey value per radius
    slope_y: Array  # (h, 1) likewise along y
    blocked: Array  # (h, w) share of the surroundings' light that the disc blocks
    shadows: Array  # (m, h, w) share of the light from further directions that the disc hides; m may be 0
    per_px: Array  # (2, 2) radii per px
    blur_px: float  # standard deviation of the gaussian blur
    kernel: Array  # (k,) its taps on the fine grid
    streak: tuple[Array, Places] | None  # (k,) taps of a motion on it and (k, 2) their columns and rows; None if still
    finer: int  # cells of the fine grid to a pixel, along each side
    clipped: float  # share of the board's pixels that are left out as black or white as a pixel can be


@dataclass(frozen=True, slots=True)
class Prior:
    """What is known before the pixels are looked at."""

    start: Array  # (8,) shape to start from
    mean: Array  # (17 + m,)
    spread: Array  # (17 + m,) standard deviations
    furthest_shadow: float  # radii
    scatter: float  # factor, 1 or more, by which the board's corners scatter more than independent noise makes them

    def with_fields(self, count: int, spread: float) -> Prior:
        """What is known with more fields of light beside the patch's shadows, each 0 with a spread, grey values."""
        return replace(
            self, mean=np.append(self.mean, np.zeros(count)), spread=np.append(self.spread, np.full(count, spread))
        )


@dataclass(frozen=True, slots=True)
class DiscFit:
    """The fit of one disc."""

    values: Array  # (17 + m,)
    covariance: Array  # (17 + m, 17 + m)
    converged: bool
    residual: float  # mean square, grey values^2
    unexplained: float  # factor of the covariance for what neighbouring pixels share, see `circle_scatter`
    with_size: Array  # (2,) radii by which the place moves with the size, for a change of it by 1
    oblong: float  # by how many variances the sum of squares would be less if nothing were known of its form
    fields_px: Array  # (2,) by which the picture moved between even rows and odd ones, as in interlaced video
