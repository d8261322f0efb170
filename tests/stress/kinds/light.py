"""Kinds that differ by the light on the board and in the lens."""

import numpy as np
from scipy.ndimage import gaussian_filter

from tests.stress import surroundings as around
from tests.stress.boards import Board
from tests.stress.cameras import camera
from tests.stress.kind import Kind


def _paper(linear, rng):
    """A texture of 3 % as rough paper has."""
    return linear * (1.0 + 0.2 * gaussian_filter(rng.standard_normal(linear.shape), 2.0))


def _all(scene, points):
    """Where a spot of light falls is drawn by the camera: no point is asked for."""
    return np.ones(len(points), bool)


def blinds(left):
    """Stripes of shadow as of blinds, 10 to 60 px wide, which leave so much of the light; their edges are soft."""

    def lit(linear, rng):
        height, width = linear.shape[:2]
        angle, period = rng.uniform(0.0, np.pi), 2.0 * np.exp(rng.uniform(np.log(10.0), np.log(60.0)))
        y, x = np.mgrid[:height, :width]
        across = np.cos(angle) * x + np.sin(angle) * y + rng.uniform(0.0, period)
        shadow = gaussian_filter((across % period < 0.5 * period).astype(float), 1.5)
        return linear * (1.0 - (1.0 - left) * shadow)

    return lit


KINDS = (
    Kind("low-contrast", "black at 3/4 of white, 120 and 90", board=Board(print_grey=0.6), camera=camera(gain=150.0)),
    Kind("faint", "white 112 and black 104", board=Board(print_grey=0.743), camera=camera(gain=140.0)),
    Kind("overexposed", "white at 1.6 times what the sensor holds", camera=camera(gain=510.0)),
    Kind("underexposed", "white at 20, black at 1", camera=camera(gain=25.0, noise=0.5)),
    Kind("vignetting", "a fifth of the light in the corners of the picture", light=around.vignetting),
    Kind("gradient", "light that falls by 1 to 5 across the picture", light=around.gradient(5.0)),
    Kind("shadow-edge", "a hard shadow across the board, 0.3 of the light", scene=around.hard_shadow),
    Kind("blinds", "stripes of shadow, half the light, 10 to 60 px wide", light=blinds(0.5)),
    Kind("blinds-deep", "stripes of shadow, a quarter of the light", light=blinds(0.25)),
    Kind("glare", "a spot of glare that clips", light=around.glare(2.0, 0.05), lost=_all),
    Kind("veil", "a soft bright spot, nothing clips", light=around.glare(0.15, 0.15)),
    Kind("ghost", "an eighth of the picture upside down, as a pane reflects", light=around.ghost),
    Kind("flicker", "rows exposed in turn under lamps that flicker", light=around.flicker),
    Kind("paper", "rough paper, 3 %", light=_paper),
    Kind("disc-shadow", "the disc's shadow 9 mm aside, with a hard edge",
         board=Board(shadow_offset=9.0, shadow_depth=0.6, shadow_edge=1.0)),
)  # fmt: skip
