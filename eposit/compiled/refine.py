"""Poses of another method taken to the minimum of the reprojection error near them."""

from __future__ import annotations

import math

from eposit.compiled.descent import MINIMUM, descend
from eposit.compiled.kernel import NOTHING, POINTER, WHOLE, W, compiled
from eposit.compiled.layout import (
    CENTRE,
    FACTORS,
    ITERATIONS,
    MINIMA,
    POSE,
    PRICE,
    RMSE,
    SIZE,
    STATUS,
    STEPS,
)
from eposit.compiled.observe import (
    NOT_CONVERGED,
    OK,
    TOO_FEW,
    no_pose,
    observe,
    place,
    squares_px,
    weigh,
    write_result,
)
from eposit.compiled.search import is_seen
from eposit.compiled.shape import TOO_FEW_POINTS, describe

IMAGE_CIRCLE_ALLOWANCE = 0.05  # share of the radius by which noise may lift a point over the image circle


@compiled(NOTHING, W, POINTER, WHOLE)
def read_pose(w, poses, first):
    """At MINIMA the pose at `first` of poses, in the object's frame and unit, for the points about their centroid."""
    for i in range(3):
        part = poses[first + 9 + i]
        for j in range(3):
            w[MINIMA + 3 * i + j] = poses[first + 3 * i + j]
            part += poses[first + 3 * i + j] * w[CENTRE + j]
        w[MINIMA + 9 + i] = part / w[SIZE]


@compiled(NOTHING, W, WHOLE, POINTER, POINTER, POINTER, WHOLE, WHOLE, WHOLE, WHOLE, POINTER, POINTER)
def refine_poses(w, n, points, pixels, weights, m, b, first, stop, starts, out):
    """From starts (b, 12), R row by row and then t, of the images from `first` to `stop` of b into out, LINEAR_RESULT
    numbers each, as in `layout`.

    w: workspace with LENS and INTRINSICS written. points (n, 3); pixels (b, n, 2); weights (m, 3): inverse covariances
    in px^-2 (xx, xy, yy), m = n or 1 for all points.
    """
    place(w, n, points)
    whole = describe(w, n)
    weigh(w, n, weights, m)
    for row in range(first, stop):
        o = POSE * row
        state, w[STEPS] = observe(w, n, pixels, row, IMAGE_CIRCLE_ALLOWANCE), 0.0
        if state == OK and whole == TOO_FEW_POINTS:
            state = TOO_FEW
        if state == OK:
            read_pose(w, starts, 12 * row)
            if descend(w, n, MINIMA, 0, FACTORS, 0.0) != MINIMUM or is_seen(w, n, MINIMA) == 0:
                state = NOT_CONVERGED
        if state != OK:
            no_pose(w, MINIMA)
        out[o + STATUS], out[o + ITERATIONS] = state, w[STEPS]
        write_result(w, out, b, row)
        squares = squares_px(w, n, MINIMA) if state == OK else math.nan
        out[o + RMSE], out[o + PRICE] = math.sqrt(squares / n), squares
