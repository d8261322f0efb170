"""Robust least squares on the pixels: pose, width of the point spread and light together, from a pose nearby."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from eposit import Camera, Pose, Status
from eposit.arrays import Array
from eposit.pose import rotation_error_vector
from pipelines.detection.tone_curve import Light
from pipelines.photometric.covariance import at_least, sandwich
from pipelines.photometric.image_flow import POSE
from pipelines.photometric.noise import EDGE_SHARE, Noise
from pipelines.photometric.normal_equations import Step, solve, solve_light
from pipelines.photometric.picture import PictureModel, Shape
from render.targets.chessboard import Chessboard

MOST_STEPS = 12  # three to five are usual; it bounds the time that a picture takes
LEAST_STEPS = 2  # the noise of the first comes from residuals of the start
STOP = 0.1  # step, in standard deviations of the pose, at which the search has ended; it is still made
CAUCHY = 5.0  # deviations at which a pixel has half its weight; gaussian noise then costs 1 % of the information
WHITEST, CLIPPED = 255.0, 3.0  # grey value at which a picture is clipped, and deviations below it that noise spans
MOST_DOUBTED = 0.25  # share of the pixels on edges that may have less than half their weight
MOST_MOVED = 5.0  # root mean square over six directions, in deviations of start and result together


class Refined(NamedTuple):
    """The outcome of one picture; every status but ok comes without a pose."""

    status: Status
    shape: Shape | None
    covariance: Array  # (6, 6) as in `eposit.Solution`, NaN without a pose
    iterations: int


class _Iterate(NamedTuple):
    """Where the search is."""

    shape: Shape
    fields: Array  # (nodes, 3) of the light


class _Fit(NamedTuple):
    """What one iteration found at an iterate."""

    step: Step
    covariance: Array  # (7, 7)
    doubted: float  # share of the pixels on edges that contradict


def refine(
    light: NDArray[np.uint8] | Light,
    camera: Camera,
    target: Chessboard,
    start: Pose,
    start_covariance: Array,
    sigma_px: float,
) -> Refined:
    """The pose at which the model's picture is likest to the light, (height, width) on the scale of grey values.

    start: at most about a width of the point spread from the true one. start_covariance: (6, 6) of it.
    sigma_px: width of the point spread to start from.
    Status:
        not_converged: no end within MOST_STEPS. inconsistent: the picture contradicts the model at the end, so much
        perhaps that the pose is less certain than its start, or the pose has moved farther than its start's covariance
        allows. no_solution: the pixels do not determine the pose.
    """
    shape = Shape(start, sigma_px)
    steps = 0
    try:
        model = PictureModel.around(target, camera, shape)
        observed = model.observed(light)
        at = _Iterate(shape, _first_light(model, shape, observed))
        for steps in range(1, MOST_STEPS + 1):
            fit = _fit(model, at, observed)
            at = _Iterate(at.shape.changed(fit.step.shape), at.fields + fit.step.fields)
            if steps >= LEAST_STEPS and _length(fit.step.shape[:POSE], fit.step.covariance) <= STOP:
                return _judged(at.shape, fit, start, start_covariance, steps)
    except (np.linalg.LinAlgError, ValueError):
        return _failed(Status.NO_SOLUTION, steps)
    return _failed(Status.NOT_CONVERGED, steps)


def _first_light(model: PictureModel, shape: Shape, observed: Array) -> Array:
    dark = model.dark()
    sums = model.sums(model.picture(shape, dark), observed, np.ones(len(observed)))
    return solve_light(sums, model.grid, dark)


def _fit(model: PictureModel, at: _Iterate, observed: Array) -> _Fit:
    modelled = model.picture(at.shape, at.fields)
    grey = modelled.grey[model.used]
    residuals = observed - grey
    slope = np.hypot(*modelled.channels[2:4, model.used])
    variance = Noise.of(residuals, grey, slope).variance(grey, slope)
    trust = 1.0 / (1.0 + residuals**2 / (variance * CAUCHY**2))
    trust[grey > WHITEST - CLIPPED * np.sqrt(variance)] = 0.0  # by the model, as noise would choose among observed ones
    sums = model.sums(modelled, residuals, trust / variance)
    step = solve(sums, model.grid, at.fields)
    covariance = at_least(step.covariance, sandwich(sums, step, model.grid))
    doubted = (trust > 0.0) & (trust < 0.5)
    return _Fit(step, covariance, float(np.mean(doubted[slope > EDGE_SHARE * slope.max()])))


def _judged(shape: Shape, fit: _Fit, start: Pose, start_covariance: Array, steps: int) -> Refined:
    pose, covariance = shape.cam_from_obj, fit.covariance[:POSE, :POSE]
    moved = np.concatenate((rotation_error_vector(pose.R, start.R), pose.t - start.t))
    too_far = _length(moved, start_covariance + covariance) > MOST_MOVED
    if fit.doubted > MOST_DOUBTED or too_far or _relative_variance(covariance, start_covariance) > 1.0:
        return _failed(Status.INCONSISTENT, steps)
    return Refined(Status.OK, shape, covariance, steps)


def _length(change: Array, covariance: Array) -> float:
    """Root mean square of a change of pose (6,) in deviations of a covariance, (6, 6) or more."""
    scale = np.sqrt(np.diag(covariance)[:POSE])
    whitened = np.linalg.solve(covariance[:POSE, :POSE] / np.outer(scale, scale), change / scale)
    return float(np.sqrt(max(whitened @ (change / scale), 0.0) / POSE))


def _relative_variance(covariance: Array, other: Array) -> float:
    """Mean over six directions of one covariance's variances by those of another one, (6, 6) both."""
    scale = np.sqrt(np.diag(other))
    outer = np.outer(scale, scale)
    return float(np.trace(np.linalg.solve(other / outer, covariance / outer)) / POSE)


def _failed(status: Status, steps: int) -> Refined:
    return Refined(status, None, np.full((POSE, POSE), np.nan), steps)
