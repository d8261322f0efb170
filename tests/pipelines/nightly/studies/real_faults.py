"""The faults of `faults` on real pictures: in what detection finds, in the solver's camera, end or time."""

from __future__ import annotations

import dataclasses

import numpy as np

from pipelines.detection import detect_points
from tests.pipelines.nightly.studies.faults import LENS
from tests.pipelines.nightly.studies.real_nights import Fault


def _in_one_lens(change):
    def points(found, camera, truth, rng):
        return change(found, truth, rng) if camera == LENS else found

    return Fault(points)


def _moved(found, step):
    return dataclasses.replace(found, points_px=found.points_px + step)


def corner_bias(size_px):
    """Corners of one lens lie too far along x."""

    def change(found, truth, rng):
        step = np.zeros_like(truth)
        step[:-1, 0] = size_px
        return _moved(found, step)

    return _in_one_lens(change)


def more_noise(share):
    """Corners of one lens scatter more."""

    def change(found, truth, rng):
        scatter = np.sqrt(np.mean((found.points_px - truth)[:-1] ** 2, axis=0))
        step = np.sqrt((1.0 + share) ** 2 - 1.0) * scatter * rng.standard_normal(truth.shape)
        step[-1] = 0.0
        return _moved(found, step)

    return _in_one_lens(change)


def circle_shift(size_px):
    """The circle's centre in one lens lies too far along x."""

    def change(found, truth, rng):
        step = np.zeros_like(truth)
        step[-1, 0] = size_px
        return _moved(found, step)

    return _in_one_lens(change)


def small_covariance(share):
    """Covariances of the points of one lens are stated too small."""

    def change(found, truth, rng):
        return dataclasses.replace(found, covariance_px2=(1.0 - share) * found.covariance_px2)

    return _in_one_lens(change)


def shift(size_px):
    """All points of all lenses lie too far along x."""

    def points(found, camera, truth, rng):
        return _moved(found, np.array([size_px, 0.0]))

    return Fault(points)


def new_failure(recipe_target, truth_of_frame):
    """One picture, known by its true points, shows no board any more."""

    def points(found, camera, truth, rng):
        if truth is None or not np.array_equal(truth, truth_of_frame):
            return found
        return detect_points(np.full((240, 320), 128, np.uint8), recipe_target)

    return Fault(points)


def longer_focal_length(share):
    """The solver takes one lens's focal length too long."""

    def camera(assumed, name):
        longer = {axis: getattr(assumed, axis) * (1.0 + share) for axis in ("fx", "fy")}
        return assumed.replace(**longer) if name == LENS else assumed

    return Fault(camera=camera)
