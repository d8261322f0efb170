"""Poses in another unit, or inverted, are told from good and from poor ones."""

from pathlib import Path

import numpy as np
import pytest

from eposit import Pose, Status
from eposit.pose import rotation_from_vector
from pipelines.adapters.results import PoseResult
from pipelines.stages.pose_conventions import ConventionErrors
from pipelines.stages.pose_formats import FORMATS, TABLE

COUNT = 40


def true_poses():
    """Of a camera a metre or two from a board, as far as 60 degrees from facing it."""
    rng = np.random.default_rng(4)
    R = rotation_from_vector(rng.uniform(-0.6, 0.6, (COUNT, 3)))
    return Pose(R, rng.uniform((-300.0, -300.0, 800.0), (300.0, 300.0, 2000.0), (COUNT, 3)))


def moved(true, radians, share):
    """Poses with errors of some rad per axis, and of a share of the distance per axis."""
    rng = np.random.default_rng(5)
    R = rotation_from_vector(radians * rng.standard_normal((COUNT, 3))) @ true.R
    return Pose(R, true.t + share * np.linalg.norm(true.t, axis=1, keepdims=True) * rng.standard_normal((COUNT, 3)))


def warning_of(found, status: str = Status.OK, true=None, form=TABLE):
    errors = ConventionErrors(FORMATS[form])
    answers = {i: PoseResult(status, found.R[i], found.t[i]) for i in range(COUNT)}
    for half in (range(COUNT // 2), range(COUNT // 2, COUNT)):
        rows = np.array(half)
        truth = true or true_poses()
        errors.add(list(half), Pose(truth.R[rows], truth.t[rows]), answers)
    return errors.warning(Path("theirs.csv"))


def scaled(pose, factor):
    return Pose(pose.R, pose.t * factor)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda pose: scaled(pose, 1e-3), "hold positions in metres instead of mm: read"),
        (lambda pose: scaled(pose, 0.1), "hold positions in centimetres instead of mm: read"),
        (lambda pose: pose.inverse(), "hold obj_from_cam instead of cam_from_obj: read"),
        (
            lambda pose: scaled(pose.inverse(), 1e-3),
            "positions in metres instead of mm and obj_from_cam instead of cam_from_obj",
        ),
    ],
    ids=["metres", "centimetres", "inverse", "both"],
)
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_another_unit_or_direction_is_named(change, words, noise):
    warning = warning_of(change(moved(true_poses(), noise, noise)))
    assert warning is not None
    assert words in warning
    assert warning.startswith("theirs.csv ")


# 1e-9: exact poses; 0.01: a degree and a hundredth of the distance; 1: no better than chance.
@pytest.mark.parametrize("noise", [0.0, 1e-9, 0.01, 0.1, 1.0])
def test_good_and_poor_poses_are_left_alone(noise):
    assert warning_of(moved(true_poses(), noise, noise)) is None


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda pose: scaled(pose, 1e3), "hold positions in mm instead of metres: read"),
        (lambda pose: pose.inverse(), "hold cam_from_obj instead of obj_from_cam: read"),
        (lambda pose: pose, None),
    ],
    ids=["mm", "inverse", "good"],
)
def test_what_is_meant_is_told_in_the_terms_of_the_format(change, words):
    """TUM's are metres and obj_from_cam, and are converted before."""
    warning = warning_of(change(true_poses()), form="tum")
    assert warning is None if words is None else words in (warning or "")


def test_a_few_gross_failures_hide_nothing():
    found = true_poses().inverse()
    found.t[: COUNT // 4] = 1e29
    assert "obj_from_cam" in (warning_of(found) or "")


def test_a_pose_that_is_its_own_inverse_tells_nothing():
    true = Pose(np.broadcast_to(np.diag([1.0, -1.0, -1.0]), (COUNT, 3, 3)), np.tile([0.0, 0.0, 1000.0], (COUNT, 1)))
    assert warning_of(true.inverse(), true=true) is None


def test_failures_are_not_compared():
    assert warning_of(scaled(true_poses(), 1e-3), status="lost") is None
