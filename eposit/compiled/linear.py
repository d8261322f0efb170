"""POSIT, EPOSIT and centred EPOSIT as methods of their own: the iteration, and a check of what it ends in."""

from __future__ import annotations

import math

from eposit.compiled.kernel import NOTHING, NUMBER, POINTER, WHOLE, W, compiled
from eposit.compiled.layout import (
    IMAGE,
    INFO,
    ITERATIONS,
    LENS,
    MINIMA,
    PERSPECTIVE,
    POINTS,
    POSE,
    PRICE,
    RAYS,
    REACH,
    RMSE,
    SEEN,
    SOLID,
    STARTS,
    STATUS,
    STEPS,
)  # fmt: skip
from eposit.compiled.lens import ray
from eposit.compiled.observe import (
    BEYOND_90,
    COPLANAR,
    INCONSISTENT,
    NOT_CONVERGED,
    OK,
    TOO_FEW,
    no_pose,
    observe,
    place,
    squares_px,
    write_result,
)  # fmt: skip
from eposit.compiled.orthography import CONTRACTS, K, fixed_point, orthography, write_fixed_point
from eposit.compiled.p3p import p3p, ray_misfit
from eposit.compiled.search import centred_image, is_sure, turn_back
from eposit.compiled.shape import DESCRIBED, TOO_FEW_POINTS, describe

POSIT, EPOSIT, CENTRED = 0, 1, 2
CONVERGENT_TAN2 = 2.0  # squared tangent of the incidence angle beyond which the iteration no longer contracts
DOUBTFUL_MISFIT = 1e-3  # misfit over spread above which a fixed point is compared with the poses of a triangle
CONSISTENT_MISFIT = 0.1  # misfit over spread above which a fixed point is no pose
QUICK = 40  # iterations to a relative change of 1e-12: half of it in each step
EXACT_MISFIT = 1e-7  # misfit over spread of a triangle's pose that shows noise-free points, which EPOSIT then must fit


@compiled(WHOLE, W, WHOLE, WHOLE, NUMBER, NUMBER)
def rectified(w, n, method, shift_x, shift_y):
    """At IMAGE pinhole points of SEEN and RAYS, NaN at or beyond 90 degrees; whether there are any such.

    shift_x, shift_y: where theta is measured from, over the focal length; not used for POSIT.
    Source:
        Paper, Table I and equations 21 and 22: G(theta) = cos(theta) / g(theta), so that x' / (f G) is at depth 1.
    """
    forward = 1
    for i in range(n):
        r, image, seen = POINTS + RAYS * n + 3 * i, POINTS + IMAGE * n + 2 * i, POINTS + SEEN * n + 2 * i
        if not w[r + 2] > 0.0:
            forward = 0
        if w[LENS] == PERSPECTIVE:
            w[image], w[image + 1] = w[seen], w[seen + 1]
        elif method == EPOSIT:
            x, y = w[seen] - shift_x, w[seen + 1] - shift_y
            side, cosine = ray(w, x * x + y * y)
            over = side / cosine if cosine > 0.0 else math.nan
            w[image], w[image + 1] = w[seen] * over, w[seen + 1] * over
        else:
            over = 1.0 / w[r + 2] if w[r + 2] > 0.0 else math.nan
            w[image], w[image + 1] = w[r] * over, w[r + 1] * over
    return forward


@compiled(NUMBER, W, WHOLE, WHOLE)
def misfit_of(w, n, pose):
    """RMS distance of the pinhole points from the pose's, NaN behind the camera."""
    total = 0.0
    for i in range(n):
        o, image = POINTS + 3 * i, POINTS + IMAGE * n + 2 * i
        a, b, c = w[o], w[o + 1], w[o + 2]
        z = w[pose + 6] * a + w[pose + 7] * b + w[pose + 8] * c + w[pose + 11]
        if not z > 0.0:
            return math.nan
        x = (w[pose] * a + w[pose + 1] * b + w[pose + 2] * c + w[pose + 9]) / z - w[image]
        y = (w[pose + 3] * a + w[pose + 4] * b + w[pose + 5] * c + w[pose + 10]) / z - w[image + 1]
        total += x * x + y * y
    return math.sqrt(total / n)


@compiled(NUMBER, W, WHOLE)
def spread_of(w, n):
    """RMS distance of the pinhole points from their mean."""
    x = y = total = 0.0
    image = POINTS + IMAGE * n
    for i in range(n):
        x += w[image + 2 * i] / n
        y += w[image + 2 * i + 1] / n
    for i in range(n):
        total += (w[image + 2 * i] - x) ** 2 + (w[image + 2 * i + 1] - y) ** 2
    return math.sqrt(total / n)


@compiled(WHOLE, W, WHOLE, NUMBER, WHOLE)
def iterate_checked(w, n, tol, max_iterations):
    """At MINIMA the fixed point's pose; the status; STEPS is the number of iterations.

    The fixed point that the iteration finds need not be the pose (about one random object in a thousand), and a pose
    need not attract it. A misfit of a tenth of the points' spread tells, and for noise-free points the poses of a
    triangle do: one of them fits exactly. From it the same equations are iterated again with half steps, provided
    that all points lie below atan(sqrt 2). Under noise a flat object's misfit is large and no reason to reject. The
    triangle is left out where the iteration has one fixed point, and where the pose is sure to be the only one so
    faithful.
    """
    contraction = orthography(w, n)
    count = fixed_point(w, contraction, tol, max_iterations, 0.0, 1.0)
    write_fixed_point(w, n, MINIMA)
    spread, misfit = spread_of(w, n), misfit_of(w, n, MINIMA) if count > 0 else math.nan
    limit = CONSISTENT_MISFIT * spread
    w[STEPS] = abs(count)
    trusted = misfit <= DOUBTFUL_MISFIT * spread or contraction <= CONTRACTS
    inside = True
    for i in range(n):  # rays of the pinhole points
        image, r = POINTS + IMAGE * n + 2 * i, POINTS + RAYS * n + 3 * i
        x, y = w[image], w[image + 1]
        inside = inside and x * x + y * y < CONVERGENT_TAN2
        over = 1.0 / math.sqrt(1.0 + x * x + y * y)
        w[r], w[r + 1], w[r + 2] = x * over, y * over, over
    if not trusted and spread < math.inf and not (0 < count <= QUICK and is_sure(w, n, MINIMA) == 1):
        best, least = STARTS, math.inf
        for i in range(p3p(w, n, STARTS)):
            off = ray_misfit(w, n, STARTS + 12 * i, math.inf)
            if off < least:
                best, least = STARTS + 12 * i, off
        if least < math.inf:
            if misfit_of(w, n, best) <= EXACT_MISFIT * spread:
                limit = DOUBTFUL_MISFIT * spread
            if not misfit <= limit and inside and w[best + 11] > 0.0:
                depth = (
                    w[best + 6] * w[POINTS] + w[best + 7] * w[POINTS + 1] + w[best + 8] * w[POINTS + 2] + w[best + 11]
                )
                for i in range(3):
                    w[K + i] = w[best + 6 + i] * w[REACH] / depth
                count = fixed_point(w, contraction, tol, max_iterations, 1.0, 0.5)
                w[STEPS] += abs(count)
                write_fixed_point(w, n, MINIMA)
                misfit = misfit_of(w, n, MINIMA) if count > 0 else math.nan
    if count < 0:
        return NOT_CONVERGED
    return OK if misfit <= limit else INCONSISTENT


@compiled(WHOLE, W, WHOLE, WHOLE, POINTER, WHOLE, WHOLE, NUMBER, NUMBER)
def prepared(w, n, whole, pixels, row, method, shift_x, shift_y):
    """The status of the image `row` before the iteration; at IMAGE its pinhole points. whole: from `describe`."""
    solid = whole != TOO_FEW_POINTS and w[SOLID] == 1.0
    state, w[STEPS] = observe(w, n, pixels, row, 0.0), 0.0
    if state == OK and method == CENTRED:
        if whole == DESCRIBED and centred_image(w, n) == 0:
            state = NOT_CONVERGED
    elif state == OK:
        forward = rectified(w, n, method, shift_x, shift_y)
        if solid and forward == 0:
            state = BEYOND_90
    if state == OK and whole == TOO_FEW_POINTS:
        return TOO_FEW
    if state in (OK, NOT_CONVERGED) and not solid:
        return COPLANAR
    return state


@compiled(NOTHING, W, WHOLE, POINTER, POINTER, WHOLE, WHOLE, WHOLE, WHOLE, NUMBER, WHOLE, NUMBER, NUMBER, POINTER)
def solve_linear(w, n, points, pixels, b, first, stop, method, tol, max_iterations, shift_x, shift_y, out):
    """Solve the images from `first` to `stop` of b of the same points into out, LINEAR_RESULT numbers, as in `layout`.

    w: workspace with LENS and INTRINSICS written.
    """
    place(w, n, points)
    for i in range(3 * n):  # no weights
        w[POINTS + INFO * n + i] = 0.0
    whole = describe(w, n)
    for row in range(first, stop):
        o = POSE * row
        state = prepared(w, n, whole, pixels, row, method, shift_x, shift_y)
        if state == OK:
            state = iterate_checked(w, n, tol, max_iterations)
        if state == OK and method == CENTRED:
            turn_back(w, MINIMA)
        if state != OK:
            no_pose(w, MINIMA)
        out[o + STATUS], out[o + ITERATIONS] = state, w[STEPS]
        write_result(w, out, b, row)
        squares = squares_px(w, n, MINIMA) if state == OK else math.nan
        out[o + RMSE], out[o + PRICE] = math.sqrt(squares / n), squares
