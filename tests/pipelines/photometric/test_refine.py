"""Refinement on the pixels: as near to the truth as the pixels allow, and a status where the picture contradicts."""

from dataclasses import replace

import numpy as np
import pytest

from eposit import Pose, Status
from eposit.pose import rotation_from_vector
from pipelines.photometric import estimate
from pipelines.photometric.pixel_bound import pixel_bound
from pipelines.photometric.refine import MOST_STEPS, refine
from tests.pipelines.photometric.small import NOISY, TARGET, small

# A start as a corner-based pose has it: 0.05 px off, and a covariance that says so.
OFF = np.array([3e-4, -2e-4, 1e-4, 0.1, -0.1, 0.5])
START = np.diag((2.0 * OFF) ** 2)
START_SIGMA_PX = 0.9


def refined(case, image, off=OFF, start=START):
    true = case.frame.cam_from_obj
    pose = Pose(rotation_from_vector(off[:3]) @ true.R, true.t + off[3:])
    return refine(image, case.frame.camera, TARGET, pose, start, START_SIGMA_PX)


@pytest.fixture(scope="module")
def case():
    return small()


def test_errors_reach_the_bound_and_keep_to_the_stated_covariance(case):
    bound = pixel_bound(case.linear, NOISY, case.frame)
    over, stated = [], []
    for seed in range(5):
        found = refined(case, case.picture(seed=seed))
        assert found.status == Status.OK
        error = case.error(found.shape.cam_from_obj)
        over.append(error @ np.linalg.solve(bound, error))
        stated.append(error @ np.linalg.solve(found.covariance, error))
    # 30 squares of unit variance scatter about their mean by 26 %: three such deviations, on 1.1 squared for the bound.
    assert np.sqrt(np.mean(over) / 6.0) < 1.45
    assert 0.3 < np.mean(stated) / 6.0 < 1.8


def test_a_tone_curve_is_undone_first(case):
    """In grey and in colour. Taken for light, such a picture contradicts the model."""
    encoded = case.picture(replace(NOISY, gamma=2.2))
    for image in (encoded, np.repeat(encoded[..., None], 3, axis=2)):
        found = estimate(image, case.frame.camera, TARGET)
        assert found.status == Status.OK
        error = case.error(Pose(found.R, found.t))
        # 6 squares of unit variance are below 16.8 in 99 of 100 pictures.
        assert error @ np.linalg.solve(found.covariance, error) < 16.8


def test_the_same_picture_gives_the_same_bits(case):
    image = case.picture()
    one, two = refined(case, image), refined(case, image.copy())
    assert np.array_equal(one.shape.cam_from_obj.t, two.shape.cam_from_obj.t)
    assert np.array_equal(one.covariance, two.covariance)


def test_a_pose_that_leaves_its_start_farther_than_the_start_allows_is_inconsistent(case):
    assert refined(case, case.picture(), start=START * 1e-4).status == Status.INCONSISTENT


def test_a_pose_that_is_less_certain_than_its_start_is_inconsistent(case):
    """The pixels hold more than any points read from them, unless the picture is not the model's."""
    found = refined(case, case.picture())
    off = 0.1 * np.sqrt(np.diag(found.covariance))
    for share, status in ((1.2, Status.OK), (0.8, Status.INCONSISTENT)):
        assert refined(case, case.picture(), off, share * found.covariance).status == status


def test_a_picture_of_something_else_is_no_pose(case):
    noise = np.random.default_rng(1).integers(0, 255, (300, 400), dtype=np.uint8)
    for image in (noise, np.full((300, 400), 90, np.uint8), case.picture()[::-1].copy()):
        found = refined(case, image)
        assert found.status != Status.OK
        assert found.shape is None
        assert found.iterations <= MOST_STEPS
        assert np.all(np.isnan(found.covariance))


def test_an_occluder_costs_accuracy_not_truth(case):
    image = case.picture()
    image[:, 190:200] = 90  # a grey pole over the board
    found = refined(case, image)
    error = case.error(found.shape.cam_from_obj)
    assert found.status == Status.OK
    # Chi-square of six beyond 28 has a chance of 1e-4; twice that for the pole's own edges.
    assert error @ np.linalg.solve(found.covariance, error) < 60.0


def test_clipped_light_costs_accuracy_not_truth(case):
    """Where the light is strongest the picture is clipped: those pixels tell nothing of their light."""
    bright = np.clip(np.rint(np.linspace(1.0, 1.6, 400) * case.picture()), 0, 255).astype(np.uint8)
    assert np.mean(bright == 255) > 0.05
    whole, found = refined(case, case.picture()), refined(case, bright)
    error = case.error(found.shape.cam_from_obj)
    assert found.status == Status.OK
    # Chi-square of six beyond 28 has a chance of 1e-4.
    assert error @ np.linalg.solve(found.covariance, error) < 28.0
    # Half of the edges are left on a quarter of the board; light that is fitted to clipped pixels makes it 6 times.
    assert np.all(np.diag(found.covariance) < 3.0**2 * np.diag(whole.covariance))
