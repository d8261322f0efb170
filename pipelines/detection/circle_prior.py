"""What is known of a circle before its pixels are looked at: its form, the light, and how far either may be off."""

from __future__ import annotations

import math

import numpy as np

from eposit.arrays import Array
from pipelines.detection.circle_light import NO_SLOPE
from pipelines.detection.circle_numbers import (
    BLOCKED,
    DISC_SLOPE,
    LAMP,
    LINEAR,
    OBLONG,
    RIM,
    SHADOW,
    SHAPE,
    SIZE,
    SOFTNESS,
    WHITE_SLOPE,
    Prior,
)

START_SHADOW = (0.18, 0.18, 0.18)  # place and softness, in heights of the circle above the board
SIZE_SPREAD = 0.003  # the board's map gives the size to this: nearer or farther it looks the same to five in a thousand
FORM_SPREAD = 0.0001  # likewise its form
FORM_OF_BLUR = 0.005  # of its form, for each px by which the edges' widths are not those of a gaussian blur
MISFIT_SLOPES = 6.0  # misfits of the map, squares, that its slopes are off
SHADOW_SPREAD, SOFTNESS_MEAN, SOFTNESS_SPREAD = 0.9, 0.15, 0.15  # heights
FURTHEST_SHADOW = 3.6  # heights


def known_beforehand(
    light: float, height: float, misfit: float, beyond_px: float, form: Array, scatter: float
) -> Prior:
    """What is known of the circle before its pixels are looked at; what is not known has a wide spread.

    light: grey value of the white. height: of the circle above the board, radii. misfit: RMS distance of the corners
    from the board's map, squares. beyond_px: by which edges are wider or narrower than those of a gaussian blur.
    form: (2,) deviations of the form that the corners' errors make.
    scatter: factor by which corners scatter more than independent noise makes them; one below 1 does not count.
    """
    start = np.array([0.0, 0.0, 1.0, 0.0, 0.0, *(height * share for share in START_SHADOW)])
    expected, spread = np.zeros(SHAPE + LINEAR), np.full(SHAPE + LINEAR, 1e6)
    expected[SIZE], spread[SIZE] = 1.0, math.hypot(SIZE_SPREAD, MISFIT_SLOPES * misfit)
    spread[OBLONG] = np.hypot(math.hypot(FORM_SPREAD, FORM_OF_BLUR * beyond_px, MISFIT_SLOPES * misfit), form)
    spread[SHADOW] = height * SHADOW_SPREAD
    expected[SOFTNESS], spread[SOFTNESS] = height * SOFTNESS_MEAN, height * SOFTNESS_SPREAD
    spread[WHITE_SLOPE], spread[DISC_SLOPE] = 0.5 * light, NO_SLOPE * light
    expected[BLOCKED], spread[BLOCKED] = 0.3 * light, 0.3 * light
    expected[LAMP], spread[LAMP] = 0.6 * light, 0.6 * light
    # Half way between bell and box, which lie on both sides of most lamps' forms.
    expected[RIM], spread[RIM] = 0.3 * light, 0.3 * light
    return Prior(start, expected, spread, FURTHEST_SHADOW * height, max(scatter, 1.0))
