"""All minima of one image: starts, and a descent from each, or from one where the pose is sure to be the only one."""

from __future__ import annotations

import math

from eposit.compiled.descent import MINIMUM, copy, descend
from eposit.compiled.kernel import NOTHING, NUMBER, WHOLE, W, compiled
from eposit.compiled.layout import (
    COST,
    COSTS,
    FACTOR,
    FACTORS,
    FLATNESS,
    GRADIENT,
    HESSIAN,
    IMAGE,
    LENS,
    MINIMA,
    MOST_MINIMA,
    MOST_STARTS,
    PERSPECTIVE,
    PLANE,
    POINTS,
    RAYS,
    REACH,
    SCRATCH,
    SOLID,
    STARTS,
    STEPS,
    THICKNESS,
    TWIN,
)  # fmt: skip
from eposit.compiled.linear6 import factorise
from eposit.compiled.model import cost_at, derivatives
from eposit.compiled.orthography import fixed_point, orthography, write_fixed_point
from eposit.compiled.p3p import p3p, ray_misfit
from eposit.compiled.planar import planar_poses, turn_to_axis

START_TOL = 1e-3  # a start needs no more
START_ITERATIONS = 50  # the median is 7; what takes longer has usually lost its way
BOARD_RATIO = 0.02  # least over second spread of an object below which EPOSIT takes hundreds of iterations
FLAT_RATIO = 0.2  # the same ratio, below which the planar start is tried
FEW_POINTS = 5  # up to so many points all poses of a triangle are tried, of more the best two
NARROW = 0.5  # reach^2 over thickness and distance below which an object is seen nearly in parallel
FAITHFUL = 0.1  # misfit over angular thickness below which a narrow object has one pose
NEAR_COST = 25.0  # cost of a mirrored pose over the minimum's and one a point, above which perspective has decided
TURN, MISFITS = SCRATCH + 60, SCRATCH + 60


@compiled(WHOLE, W, WHOLE)
def centred_image(w, n):
    """At IMAGE pinhole points of the rays about the first, turned by TURN; False where one is at 90 degrees from it."""
    turn_to_axis(w, POINTS + RAYS * n, TURN)
    image = POINTS + IMAGE * n
    w[image] = w[image + 1] = 0.0  # the first by construction; rounding would leave 1e-16
    for i in range(1, n):
        r = POINTS + RAYS * n + 3 * i
        x, y, z = w[r], w[r + 1], w[r + 2]
        depth = w[TURN + 6] * x + w[TURN + 7] * y + w[TURN + 8] * z
        if not depth > 0.0:
            return 0
        w[image + 2 * i] = (w[TURN] * x + w[TURN + 1] * y + w[TURN + 2] * z) / depth
        w[image + 2 * i + 1] = (w[TURN + 3] * x + w[TURN + 4] * y + w[TURN + 5] * z) / depth
    return 1


@compiled(NOTHING, W, WHOLE)
def turn_back(w, pose):
    """The pose in the camera that is turned by TURN becomes that in the camera itself."""
    for j in range(4):
        p, step = pose + j, 3
        if j == 3:
            p, step = pose + 9, 1
        a, b, c = w[p], w[p + step], w[p + 2 * step]
        for i in range(3):
            w[p + step * i] = w[TURN + i] * a + w[TURN + 3 + i] * b + w[TURN + 6 + i] * c


@compiled(WHOLE, W, WHOLE, WHOLE)
def centred_start(w, n, pose):
    """At pose that of EPOSIT on rays about the first; False if it has none."""
    if centred_image(w, n) == 0:
        return 0
    contraction = orthography(w, n)
    if fixed_point(w, contraction, START_TOL, START_ITERATIONS, 0.0, 1.0) < 0:
        return 0
    write_fixed_point(w, n, pose)
    turn_back(w, pose)
    return 1 if abs(w[pose] + w[pose + 9]) < math.inf else 0


@compiled(WHOLE, W, WHOLE, WHOLE)
def is_sure(w, n, pose):
    """Whether the pose is so faithful that no other can be: False where that is not certain.

    Let two poses show an object's offsets A with misfits whose sum is e, at depth d. In POSIT's equations
    A (I - I') = (1 + eps) x - (1 + eps') x' each image moves by e, and eps by the change of k at most, which the
    image of an object of the angular size reach / d weighs little. If reach^2 / (thickness d) is well below 1, then
    |I - I'| d <= 2 e d / thickness: both lie in one basin. The two constants keep the product of both bounds far
    from 1. Of 1 040 000 random problems, exact and noisy, up to 60 per cent deep, 238 000 were sure and all right;
    of 1700 that centred EPOSIT alone got wrong, the narrow ones had 3 times this misfit, the faithful ones were 1.8
    times as wide.
    """
    far2 = 0.0
    for i in range(3):
        r = pose + 3 * i
        part = w[r] * w[POINTS] + w[r + 1] * w[POINTS + 1] + w[r + 2] * w[POINTS + 2] + w[pose + 9 + i]
        far2 += part * part
    if w[REACH] * w[REACH] > NARROW * w[THICKNESS] * math.sqrt(far2):
        return 0
    limit = (FAITHFUL * w[THICKNESS]) ** 2 / far2
    return 1 if ray_misfit(w, n, pose, limit) <= limit else 0


@compiled(NOTHING, W, WHOLE, WHOLE, WHOLE)
def exchange(w, a, b, count):
    """Exchange so many numbers at two places."""
    for i in range(count):
        w[a + i], w[b + i] = w[b + i], w[a + i]


@compiled(WHOLE, W, WHOLE, WHOLE)
def triangle_starts(w, n, starts):
    """At starts the poses of the widest triangle, of more than FEW_POINTS points the best two; how many."""
    found = p3p(w, n, starts)
    if n <= FEW_POINTS or found <= 2:
        return found
    for i in range(found):
        w[MISFITS + i] = ray_misfit(w, n, starts + 12 * i, math.inf)
    for place in range(2):
        best = place
        for i in range(place + 1, found):
            if w[MISFITS + i] < w[MISFITS + best]:
                best = i
        w[MISFITS + place], w[MISFITS + best] = w[MISFITS + best], w[MISFITS + place]
        exchange(w, starts + 12 * place, starts + 12 * best, 12)
    return 2


@compiled(WHOLE, W, WHOLE, WHOLE)
def other_starts(w, n, starts):
    """At starts poses of which one lies in the basin of the best where centred EPOSIT misses it; how many.

    EPOSIT's iteration diverges, or settles beside the truth, for about one in a hundred random objects; the poses of
    a triangle hold the rest. Points in or near a plane need a start that uses all of them, and its twin.
    """
    count = 0
    if w[FLATNESS] < FLAT_RATIO:
        count = planar_poses(w, n, starts)
        if w[FLATNESS] < BOARD_RATIO and n > FEW_POINTS and count == 2:
            return count
    return count + triangle_starts(w, n, starts + 12 * count)


@compiled(NOTHING, W, WHOLE, WHOLE)
def mirrored_pose(w, pose, out):
    """At out the pose whose plane is mirrored at right angles to the ray of its centroid.

    The plane's points keep their places across the ray, and so nearly their image: the other pose of a plane seen from
    afar, exact where its depth does not count. With v the ray and k the normal (I - 2 v v^T) R (I - 2 k k^T).
    """
    far2 = w[pose + 9] ** 2 + w[pose + 10] ** 2 + w[pose + 11] ** 2
    for j in range(3):
        along = w[pose + 9] * w[pose + j] + w[pose + 10] * w[pose + 3 + j] + w[pose + 11] * w[pose + 6 + j]
        for i in range(3):
            w[out + 3 * i + j] = w[pose + 3 * i + j] - 2.0 * w[pose + 9 + i] * along / far2
    for i in range(3):
        row = out + 3 * i
        along = w[row] * w[PLANE + 6] + w[row + 1] * w[PLANE + 7] + w[row + 2] * w[PLANE + 8]
        for j in range(3):
            w[row + j] -= 2.0 * along * w[PLANE + 6 + j]
        w[out + 9 + i] = w[pose + 9 + i]


@compiled(WHOLE, W, WHOLE, WHOLE)
def is_seen(w, n, pose):
    """Whether the lens sees all points: a law is continued past its largest angle, where a mirror image may fit."""
    if w[LENS] == PERSPECTIVE:
        return 1  # nothing else has an image
    for i in range(n):
        o = POINTS + 3 * i
        a, b, c = w[o], w[o + 1], w[o + 2]
        x = w[pose] * a + w[pose + 1] * b + w[pose + 2] * c + w[pose + 9]
        y = w[pose + 3] * a + w[pose + 4] * b + w[pose + 5] * c + w[pose + 10]
        z = w[pose + 6] * a + w[pose + 7] * b + w[pose + 8] * c + w[pose + 11]
        if z < w[LENS + 3] * math.sqrt(x * x + y * y + z * z):
            return 0
    return 1


@compiled(WHOLE, W, WHOLE, WHOLE, WHOLE, NUMBER)
def descend_all(w, n, count, known, second):
    """Descend from `count` starts; how many minima are known then, the cheapest first.

    second: 1.0 where the starts are so good that the first step takes the full Hessian, else 0.0.
    """
    i = 0
    while i < count and known < MOST_MINIMA:
        start = STARTS + 12 * i
        state = descend(w, n, start, known, FACTORS + FACTOR * known, second)
        cost = w[COST]
        if state == MINIMUM and is_seen(w, n, start) == 1:
            copy(w, start, MINIMA + 12 * known, 12)
            w[COSTS + known] = cost
            place = known
            known += 1
            while place > 0 and w[COSTS + place] < w[COSTS + place - 1]:
                exchange(w, COSTS + place, COSTS + place - 1, 1)
                exchange(w, MINIMA + 12 * place, MINIMA + 12 * (place - 1), 12)
                exchange(w, FACTORS + FACTOR * place, FACTORS + FACTOR * (place - 1), FACTOR)
                place -= 1
        if abs(w[TWIN]) < math.inf and count < MOST_STARTS:
            copy(w, TWIN, STARTS + 12 * count, 12)
            count += 1
        i += 1
    return known


@compiled(WHOLE, W, WHOLE, WHOLE)
def unrefined(w, n, count):
    """The start of lowest cost as the only minimum, with the factor of its information; 1, or 0 if there is none."""
    w[COSTS] = math.inf
    for i in range(count):
        start = STARTS + 12 * i
        cost = cost_at(w, n, start)
        if cost < w[COSTS] and is_seen(w, n, start) == 1:
            w[COSTS] = cost
            copy(w, start, MINIMA, 12)
    if not w[COSTS] < math.inf:
        return 0
    derivatives(w, n, MINIMA, 0.0, GRADIENT, HESSIAN)
    factorise(w, HESSIAN, 0.0, FACTORS)
    return 1


@compiled(WHOLE, W, WHOLE, WHOLE)
def all_minima(w, n, refine):
    """How many minima there are, the cheapest first. STEPS: the steps taken."""
    known, count = 0, 0
    w[STEPS] = 0.0
    if w[SOLID] == 1.0 and w[FLATNESS] > BOARD_RATIO and centred_start(w, n, STARTS) == 1:
        count = 1
        if refine == 1:
            known = descend_all(w, n, 1, 0, 1.0)
            if known == 1 and is_sure(w, n, MINIMA) == 1:
                return known
            count = 0
    count += other_starts(w, n, STARTS + 12 * count)
    if refine == 0:
        return unrefined(w, n, count)
    known = descend_all(w, n, count, known, 0.0)
    if known == 1 and w[FLATNESS] < FLAT_RATIO:  # both starts have come to one minimum: the other's own start
        mirrored_pose(w, MINIMA, STARTS)
        if cost_at(w, n, STARTS) < NEAR_COST * (w[COSTS] + n):
            known = descend_all(w, n, 1, known, 0.0)
    if known == 0:
        known = descend_all(w, n, triangle_starts(w, n, STARTS), 0, 0.0)
    return known
