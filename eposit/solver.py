"""`solve`: one entry for POSIT, EPOSIT, centred EPOSIT and the default method."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from eposit.arrays import Array, Mask, as_numbers, shown
from eposit.camera import Camera
from eposit.chi_square import chi_square_limit
from eposit.compiled.layout import LINEAR_RESULT, RESULT
from eposit.problem import as_bearings, as_camera, as_object, as_pixels, as_weights
from eposit.results import solve_batch, solve_one
from eposit.robust import solve_robust
from eposit.solution import Solution
from eposit.workspace import readable

METHODS = ("best", "centred", "eposit", "posit")
LINEAR = {"posit": 0, "eposit": 1, "centred": 2}
DECISIVE = 2.0 * np.log(100.0)  # -2 log of the likelihood ratio of two minima from which the data decide: 100 to 1
MOST_ITERATIONS = 1_000_000  # a call cannot be interrupted
TRUTHS, NUMBERS, WHOLES = (bool, np.bool_), (float, int, np.number), (int, np.integer)  # types of options
BENT = np.log(1.5)  # |log| of cost over parabola at three standard deviations from which the covariance is unreliable


def solve(
    points_in_obj: ArrayLike,
    points_px: ArrayLike | None = None,
    camera: Camera | None = None,
    method: str = "best",
    *,
    rays: ArrayLike | None = None,
    refine: bool = True,
    sigma_px: ArrayLike | None = None,
    robust: bool = False,
    tol: float = 1e-12,
    max_iterations: int = 2000,
    theta_centre: tuple[float, float] | None = None,
) -> Solution:
    """Pose of an object from n >= 4 points and their image, for one image or a batch.

    points_in_obj: (n, 3), any length unit; four or more must differ, and not lie on one line. points_px: (n, 2) or
        (b, n, 2), px, pixel centres at integers. NaN, or the mask of a masked array, is a missing point: the image's
        status is NON_FINITE, and `robust` leaves the point out.
    camera: the camera that took the points.
    method: "best" (every local minimum of the reprojection error, the lowest is the pose), "centred", "eposit" (the
        paper's equations), "posit" (POSIT on pinhole-equivalent points).
    rays: (n, 3) or (b, n, 3) bearing vectors of any length, in place of points_px and camera. Then what is in px is in
        radians: sigma_px, the reprojection error and the cost.
    refine: descend from the starts of "best" to minima; the other methods are linear and never refined.
    sigma_px: standard deviation of the image points: a scalar, (n,), or (n, 2, 2) covariances, px and px^2. It
        weights the points of "best" and makes cost and covariance absolute; None scales by the residuals.
    robust: leave out wrong points, of 8 or 9 up to one in four, of n >= 10 up to half, with the same result in every
        run. With sigma_px a point is wrong by that measure, else by the scatter of the others; one image in a hundred
        without a wrong point loses one. A fit that contradicts sigma_px has the status INCONSISTENT. The
        reprojection error and the covariance are those of the points in use, `inliers`.
    tol: relative change of I and J, in the last step or as it foretells the next, at which "centred", "eposit" and
        "posit" stop. max_iterations: their limit.
    theta_centre: for "eposit" only, the point, px, from which theta is measured; the paper takes the image centre.

    Returns:
        Solution; a batch gives the same poses as single calls, to the bit. `alternatives` has the other minima of
        "best"; `ambiguous`: the likelihood of one is more than a hundredth of the pose's. The covariance is that of
        "best", from the curvature of the cost, widened along the two least known rotations where the cost rises less
        than that three standard deviations away; `covariance_unreliable`: there the cost is not within a factor of
        1.5 of the parabola, or the residuals contradict sigma_px (wrong points, or another camera or object). The other
        methods do not weigh their points and state none: NaN.
    Raises:
        ValueError: wrong shapes, fewer than four points (eight with `robust`), non-finite object points, an unknown
            method or sigma, or an argument of a type that it cannot have.
    Source:
        Kang et al., EPOSIT. Centring is ours: with exact theta EPOSIT is POSIT on rectified points, and rays may be
        rectified about M0's ray as well as about the optical axis, which lifts the limit of 54.7 degrees.
    """
    _check(method, refine, robust, tol, max_iterations, theta_centre)
    obj = as_object(points_in_obj)
    if rays is not None:
        points_px, camera = as_bearings(rays, points_px, camera, len(obj))
    if camera is None or points_px is None:
        raise ValueError("solve was given no image points; give points_px and camera, or rays")
    pixels, single = as_pixels(points_px, len(obj))
    camera = as_camera(camera)
    weights, variance = as_weights(sigma_px, len(obj))
    if robust:

        def solve_part(use: Mask, pixels: Array) -> Solution:
            some = obj[use]
            if method == "best":
                return _best(
                    some, pixels, camera, weights if len(weights) == 1 else weights[use], variance, refine, False
                )
            return _linear(some, pixels, camera, LINEAR[method], tol, max_iterations, theta_centre, False)

        found = solve_robust(solve_part, obj, pixels, camera, weights, variance)
        return found.first() if single else found
    if method == "best":
        return _best(obj, pixels, camera, weights, variance, refine, single)
    return _linear(obj, pixels, camera, LINEAR[method], tol, max_iterations, theta_centre, single)


def _check(
    method: object, refine: object, robust: object, tol: object, max_iterations: object, theta_centre: ArrayLike | None
) -> None:
    """Refuse options that no solver can take.

    Raises:
        ValueError: with the option and what it may be.
    """
    if not isinstance(method, str) or method not in METHODS:
        raise ValueError(f"unknown method {shown(method)}; known methods are {', '.join(METHODS)}")
    for name, value in (("refine", refine), ("robust", robust)):
        if not isinstance(value, TRUTHS):
            raise ValueError(f"{name} is a {type(value).__name__}; it must be True or False")
    if not (isinstance(tol, NUMBERS) and 0.0 <= tol < np.inf):
        raise ValueError(f"tol is {shown(tol)}; it must be a number from 0")
    if not (isinstance(max_iterations, WHOLES) and 1 <= max_iterations <= MOST_ITERATIONS):
        raise ValueError(
            f"max_iterations is {shown(max_iterations)}; it must be a whole number from 1 to {MOST_ITERATIONS}"
        )
    if theta_centre is None:
        return
    if method != "eposit":
        raise ValueError(f"theta_centre goes with method 'eposit', not {shown(method)}; leave it out")
    centre = as_numbers(theta_centre, "theta_centre")
    if centre.shape != (2,) or not np.all(np.isfinite(centre)):
        raise ValueError(f"theta_centre is {shown(theta_centre)}; it must be two finite numbers, px")


def _best(
    obj: Array, pixels: Array, camera: Camera, weights: Array, variance: float, refine: bool, single: bool
) -> Solution:
    from eposit.compiled.best import solve_best
    from eposit.compiled.machine_code import native

    n, call = len(obj), native(solve_best)
    most = variance * chi_square_limit(2.0 * n - 6.0) if variance > 0.0 and n > 3 else np.inf

    points, images, certainty = readable(obj), readable(pixels), readable(weights)

    def run(w: int, out: int, first: int, stop: int) -> None:
        call(
            w, n, points, images, certainty, len(weights), len(pixels), first, stop, variance, refine, DECISIVE, BENT,
            most, out,
        )  # fmt: skip

    return (solve_one if single else solve_batch)(run, camera, pixels.shape[:2], RESULT, variance or 1.0)


def _linear(
    obj: Array,
    pixels: Array,
    camera: Camera,
    method: int,
    tol: float,
    max_iterations: int,
    theta_centre: tuple[float, float] | None,
    single: bool,
) -> Solution:
    from eposit.compiled.linear import solve_linear
    from eposit.compiled.machine_code import native

    n, call = len(obj), native(solve_linear)
    points, images = readable(obj), readable(pixels)
    shift_x = shift_y = 0.0
    if theta_centre is not None:
        shift_x = (theta_centre[0] - camera.cx) / camera.fx
        shift_y = (theta_centre[1] - camera.cy) / camera.fy

    def run(w: int, out: int, first: int, stop: int) -> None:
        call(
            w, n, points, images, len(pixels), first, stop, method, tol, max_iterations, shift_x, shift_y, out
        )  # fmt: skip

    return (solve_one if single else solve_batch)(run, camera, pixels.shape[:2], LINEAR_RESULT, 1.0)
