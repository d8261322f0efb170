"""The raised circle where the light on the board changes over a few squares: beside a lamp, or from row to row.

More light makes all lighter, the white as well as what lies in the disc's shade, and it may change in waves, as where
lamps flicker while the rows of a picture are exposed in turn. The model of the disc has a white with a slope that the
shade knows nothing of. So the pixels are divided by the light that a fit finds, and fitted again.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipelines.detection.circle_model import fit_disc
from pipelines.detection.circle_numbers import FURTHER, SHAPE, WHITE_GREY, WHITE_SLOPE, DiscFit, Patch, Prior
from pipelines.detection.circle_pixels import at_pixels

UNEVEN = 0.01  # of the light, by which it changes over a radius: less changes little in the shade
# Variances of its own by which this slope must differ from none: it is then known to a seventh. On a small circle noise
# makes slopes of some per cent, mostly below 40 variances, and a picture that is divided by them has another shade.
SURE_SLOPE = 50.0
CURVED = 0.1  # likewise, beyond a slope: what lamps that flicker make at 90 rows to a wave
ROUNDS = 2  # of light that is found and divided by
DARKEST = 0.3  # of the light at the circle: polynomials go astray beyond


def in_even_light(fit: DiscFit, patch: Patch, known: Prior) -> tuple[DiscFit, Patch]:
    """The fit, again in the light that it has at the circle where that explains the picture better, and its patch."""
    if not fit.converged or not _is_uneven(fit):
        return fit, patch
    x, y = np.broadcast_arrays(patch.slope_x, patch.slope_y)
    squares = np.stack((x * x, x * y, y * y))
    linear = np.stack([at_pixels(patch, np.ascontiguousarray(part)) for part in (x, y)])
    second = np.stack([at_pixels(patch, part) for part in squares])
    # Three more fields are taken from the white, as further shadows are.
    uneven, curved = replace(patch, shadows=squares), known.with_fields(3, CURVED * fit.values[WHITE_GREY])
    start = fit.values[:SHAPE]
    for done in range(ROUNDS + 1):
        found = fit_disc(uneven, replace(curved, start=start))
        if not found.converged:
            return fit, patch
        start, white = found.values[:SHAPE], found.values[WHITE_GREY]
        if done < ROUNDS:
            share = 1.0 + (found.values[WHITE_SLOPE] @ linear - found.values[FURTHER:] @ second) / white
            uneven = replace(uneven, grey=uneven.grey / np.maximum(share, DARKEST))
    even = replace(patch, grey=uneven.grey)
    again = fit_disc(even, replace(known, start=start))
    return (again, even) if again.converged and again.residual < fit.residual else (fit, patch)


def _is_uneven(fit: DiscFit) -> bool:
    """Whether the white has a slope that matters and surely is one."""
    slope, covariance = fit.values[WHITE_SLOPE], fit.covariance[WHITE_SLOPE, WHITE_SLOPE]
    matters = np.max(np.abs(slope)) >= UNEVEN * fit.values[WHITE_GREY]
    return bool(matters and slope @ np.linalg.solve(covariance, slope) >= SURE_SLOPE)
