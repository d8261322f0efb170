"""Wrong points of one image: least trimmed squares from the poses of triangles, then a forward search with a test.

The triangles are drawn by a fixed rule: the result is the same in every run.

Source:
    Fischler and Bolles 1981 (poses of random triangles); Rousseeuw and Van Driessen 2006, Computing LTS Regression for
    Large Data Sets (concentration steps); Atkinson and Riani 2000, Robust Diagnostic Regression Analysis (forward
    search); Rosner 1983, Percentage Points for a Generalized ESD Many-Outlier Procedure (the largest number of outliers
    that a test confirms is taken).
"""

from __future__ import annotations

import math

from eposit.compiled.descent import copy
from eposit.compiled.kernel import NOTHING, NUMBER, POINTER, WHOLE, W, compiled
from eposit.compiled.layout import (
    ANGULAR,
    CORNERS,
    INFO,
    INFO_STEP,
    INTRINSICS,
    LENS,
    MINIMA,
    POINTS,
    RAYS,
    RESIDUALS,
    SCRATCH,
    SEEN,
    SORTED,
    STARTS,
    WEIGHTS,
)  # fmt: skip
from eposit.compiled.lens import ray
from eposit.compiled.observe import angle_scale2, place
from eposit.compiled.p3p import p3p
from eposit.compiled.search import exchange
from eposit.compiled.shape import DESCRIBED, describe
from eposit.compiled.trimming import choose, distances, fit, residuals, smallest

MOST_TRIANGLES = 220  # all of up to 12 points; of many points, half of them wrong, 26 are right on average
THIN = 0.05  # of the widest triangle's area: narrower ones tell a pose badly
KEPT = 6  # poses of triangles that are followed
FEW = 20  # points up to which poses that are kept differ in the points nearest to them: few agree on a pose by chance
KEPT_POSES, KEPT_SUMS, KEPT_SETS = STARTS + 48, SCRATCH + 60, SCRATCH + 66
ROUNDS = 3  # of choosing the nearest points and fitting them
FALSE_ALARM = 0.01  # share of images without a wrong point that may lose one
MANY, SHARE = 256, 32  # chosen points from which a thirty-second of them is added at once
SCALE_FLOOR_PX = 1e-6  # scatter below this is rounding
IMAGE_CIRCLE_ALLOWANCE = 0.05  # share of the radius by which noise may lift a point over the image circle


@compiled(NUMBER, W)
def area(w):
    """Squared area, times four, of the triangle at CORNERS."""
    i, j, k = POINTS + 3 * int(w[CORNERS]), POINTS + 3 * int(w[CORNERS + 1]), POINTS + 3 * int(w[CORNERS + 2])
    ax, ay, az = w[j] - w[i], w[j + 1] - w[i + 1], w[j + 2] - w[i + 2]
    bx, by, bz = w[k] - w[i], w[k + 1] - w[i + 1], w[k + 2] - w[i + 2]
    return (ay * bz - az * by) ** 2 + (az * bx - ax * bz) ** 2 + (ax * by - ay * bx) ** 2


@compiled(NUMBER, W, WHOLE, WHOLE)
def nearest_points(w, n, count):
    """The `count` points that `smallest` has found, as the bits of a whole number."""
    largest, bit, found = w[POINTS + SORTED * n + count - 1], 1.0, 0.0
    for i in range(n):
        found += bit if w[POINTS + RESIDUALS * n + i] <= largest else 0.0
        bit *= 2.0
    return found


@compiled(NOTHING, W, WHOLE, WHOLE)
def try_triangle(w, n, least):
    """Keep the poses of the triangle at CORNERS that are among the KEPT of lowest trimmed squares."""
    for root in range(p3p(w, n, STARTS)):
        pose = STARTS + 12 * root
        residuals(w, n, pose)
        total, place_ = smallest(w, n, least), KEPT - 1
        nearest = nearest_points(w, n, least) if n <= FEW else -1.0
        for k in range(KEPT):
            if nearest >= 0.0 and w[KEPT_SETS + k] == nearest:
                place_ = k
        if total < w[KEPT_SUMS + place_]:
            w[KEPT_SUMS + place_], w[KEPT_SETS + place_] = total, nearest
            copy(w, pose, KEPT_POSES + 12 * place_, 12)
            while place_ > 0 and w[KEPT_SUMS + place_] < w[KEPT_SUMS + place_ - 1]:
                exchange(w, KEPT_SUMS + place_, KEPT_SUMS + place_ - 1, 1)
                exchange(w, KEPT_SETS + place_, KEPT_SETS + place_ - 1, 1)
                exchange(w, KEPT_POSES + 12 * place_, KEPT_POSES + 12 * (place_ - 1), 12)
                place_ -= 1


@compiled(NOTHING, W, WHOLE, WHOLE)
def try_triangles(w, n, least):
    """Try all triangles, or so many drawn by a linear congruential generator; thin ones are left out."""
    for k in range(KEPT):
        w[KEPT_SUMS + k], w[KEPT_SETS + k] = math.inf, -1.0
    thin = THIN * THIN * area(w)
    if n * (n - 1) * (n - 2) // 6 <= MOST_TRIANGLES:
        for i in range(n):
            for j in range(i):
                for k in range(j):
                    w[CORNERS], w[CORNERS + 1], w[CORNERS + 2] = i, j, k
                    if area(w) > thin:
                        try_triangle(w, n, least)
        return
    state, tried = 12345, 0
    for _ in range(20 * MOST_TRIANGLES):
        for k in range(3):
            state = (1103515245 * state + 12345) % 2147483648
            w[CORNERS + k] = (state // 65536) * n // 32768
        if area(w) > thin:
            try_triangle(w, n, least)
            tried += 1
            if tried == MOST_TRIANGLES:
                break


@compiled(NUMBER, W, WHOLE, WHOLE, WHOLE)
def concentrate(w, n, least, pose):
    """Fit a pose to the points nearest to it, again and again; its trimmed squares."""
    for _ in range(ROUNDS):
        residuals(w, n, pose)
        choose(w, n, least)
        fit(w, n, pose)
    residuals(w, n, pose)
    return smallest(w, n, least)


@compiled(WHOLE, W, WHOLE, WHOLE)
def trimmed(w, n, least):
    """At MINIMA a pose of least trimmed squares, with its points chosen; 0 if there is none."""
    best = math.inf
    for k in range(KEPT):
        pose = KEPT_POSES + 12 * k
        if not w[KEPT_SUMS + k] < math.inf:
            break
        total = concentrate(w, n, least, pose)
        if total < best:
            best = total
            copy(w, pose, MINIMA, 12)
    if not best < math.inf:
        return 0
    residuals(w, n, MINIMA)
    choose(w, n, least)
    return 1


@compiled(NOTHING, W, WHOLE, WHOLE, WHOLE, NUMBER)
def search_forward(w, n, least, there, variance):
    """Add the nearest points until a test refuses one or all that are `there` are chosen.

    The test: the squared residual of the nearest point outside, over its variance given the pose of those inside,
    has an F distribution with 2 and the pose's degrees of freedom, whose tail is (1 + 2 x / f)^(-f / 2). variance: of
    the residuals; 0 where it is unknown. One point is added at a time; of MANY chosen points a share at once, if the
    farthest of them passes the same test, so that the work grows as the number of points and not as its square.
    """
    m = least
    while m < there:
        fit(w, n, MINIMA)
        total, freedom, tail = distances(w, n, MINIMA), 2.0 * m - 6.0, FALSE_ALARM / (m + 1.0)
        nearest = math.inf
        for i in range(n):
            if w[POINTS + INFO * n + 3 * i] == 0.0:
                nearest = min(nearest, w[POINTS + RESIDUALS * n + i])
        if variance > 0.0:
            limit, scale = -math.log(tail), variance
        else:
            limit = 0.5 * freedom * (tail ** (-2.0 / freedom) - 1.0)
            scale = max(total / freedom, SCALE_FLOOR_PX * SCALE_FLOOR_PX)
        if not nearest <= 2.0 * scale * limit:
            return
        step = min(m // SHARE, there - m) if m >= MANY else 1
        while step > 1:
            smallest(w, n, m + step)
            if w[POINTS + SORTED * n + m + step - 1] <= 2.0 * scale * limit:
                break
            step //= 2
        m += max(step, 1)
        choose(w, n, m)


@compiled(WHOLE, W, WHOLE, POINTER, WHOLE, POINTER, WHOLE)
def observe_any(w, n, pixels, row, weights, m):
    """The image `row` of pixels (b, n, 2) at SEEN, RAYS and WEIGHTS, NaN for a missing point; how many are there."""
    there, fx, fy = 0, w[INTRINSICS], w[INTRINSICS + 1]
    for i in range(n):
        k, p = 3 * min(i, m - 1), 2 * (n * row + i)
        u, v = (pixels[p] - w[INTRINSICS + 2]) / fx, (pixels[p + 1] - w[INTRINSICS + 3]) / fy
        rho2 = u * u + v * v
        excess, factor = math.sqrt(rho2) / w[LENS + 2], 1.0
        if 1.0 < excess <= 1.0 + IMAGE_CIRCLE_ALLOWANCE:
            factor = (1.0 - 1e-12) / excess
        side, cosine = ray(w, rho2 * factor * factor)
        seen = side < math.inf
        there += 1 if seen else 0
        e, r, j = POINTS + SEEN * n + 2 * i, POINTS + RAYS * n + 3 * i, POINTS + WEIGHTS * n + 3 * i
        w[e], w[e + 1] = u if seen else 0.0, v if seen else 0.0
        w[r], w[r + 1], w[r + 2] = u * factor * side, v * factor * side, cosine
        over = 1.0 / angle_scale2(rho2) if w[ANGULAR] == 1.0 else 1.0
        w[j] = weights[k] * fx * fx * over if seen else math.nan
        w[j + 1], w[j + 2] = weights[k + 1] * fx * fy * over, weights[k + 2] * fy * fy * over
    return there


@compiled(NOTHING, W, WHOLE, WHOLE, WHOLE, POINTER, POINTER, WHOLE)
def tell(w, n, row, found, inliers, sums, place_):
    """Into the row of inliers (., n) the chosen points, all where none are found; into sums (., 2) the squares."""
    first, total = n * row, 0.0
    if found == 1:
        fit(w, n, MINIMA)
        residuals(w, n, MINIMA)
    for i in range(n):
        chosen = found == 0 or w[POINTS + INFO * n + 3 * i] > 0.0
        inliers[first + i] = 1.0 if chosen else 0.0
        if found == 1 and chosen:
            total += w[POINTS + RESIDUALS * n + i]
    sums[2 * row] = w[KEPT_SUMS + place_] if found == 1 else 0.0
    sums[2 * row + 1] = total


@compiled(NOTHING, W, WHOLE, POINTER, POINTER, POINTER, WHOLE, WHOLE, NUMBER, WHOLE, POINTER, POINTER)
def find_inliers(w, n, points, pixels, weights, m, b, variance, kept, inliers, sums):
    """Into inliers (b, kept, n) 1 for points that agree on one pose: three in four or more of 8 or 9, half of more.

    weights (m, 3): inverse covariances in px^-2, m = n or 1; variance: what they are to be divided by, px^2, 0 where it
    is unknown. A point that is NaN or that no ray reaches counts as wrong. All 1 where too few are there.
    kept: 1, or KEPT for n up to FEW; each of KEPT poses then has a row, NaN where there are not so many.
    sums (b, kept, 2): the squares of the least number of points, then those of the inliers, for these weights.
    """
    place(w, n, points)
    whole = describe(w, n)
    least = n - n // 2 if n >= 10 else n - n // 4
    first, second, third = w[CORNERS], w[CORNERS + 1], w[CORNERS + 2]
    w[INFO_STEP] = 3.0
    for row in range(b):
        there, found = observe_any(w, n, pixels, row, weights, m), 0
        if whole == DESCRIBED and there >= least:
            w[CORNERS], w[CORNERS + 1], w[CORNERS + 2] = first, second, third
            try_triangles(w, n, least)
            found = trimmed(w, n, least)
        if kept == 1:
            if found == 1:
                search_forward(w, n, least, there, variance)
            tell(w, n, row, found, inliers, sums, 0)
            continue
        for k in range(kept):
            pose = KEPT_POSES + 12 * k
            if found == 1 and w[KEPT_SUMS + k] < math.inf:
                copy(w, pose, MINIMA, 12)
                w[KEPT_SUMS + k] = concentrate(w, n, least, MINIMA)
                choose(w, n, least)
                search_forward(w, n, least, there, variance)
                tell(w, n, kept * row + k, 1, inliers, sums, k)
            elif k == 0:
                tell(w, n, kept * row, 0, inliers, sums, 0)
            else:
                sums[2 * (kept * row + k)], sums[2 * (kept * row + k) + 1] = math.inf, math.inf
