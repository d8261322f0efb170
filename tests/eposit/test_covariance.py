"""Stated covariances against the scatter of poses under repeated noise, where few points make every degree count."""

import numpy as np
import pytest

import eposit
from eposit import opnp
from eposit.pose import rotation_error_vector
from tests.cameras import PAPER_OBJECT, helix_pose, paper_camera

FIVE = np.vstack((PAPER_OBJECT, [(120.0, 90.0, -150.0)]))


@pytest.mark.parametrize(("points", "solve"), [(PAPER_OBJECT, opnp.solve), (FIVE, opnp.solve), (FIVE, eposit.solve)])
def test_without_sigma_the_mean_stated_variance_is_that_of_repeated_noise(points, solve):
    """Whoever does not know sigma must be told, on average, the variance with which poses really scatter."""
    camera, pose, rng, draws = paper_camera("perspective"), helix_pose(30.0), np.random.default_rng(31), 250
    exact = camera.project(pose.apply(points))
    # 0.1 px is small enough that the pose is linear in the noise.
    found = solve(points, exact + 0.1 * rng.standard_normal((draws, len(points), 2)), camera)
    assert set(found.status) == {"ok"}
    rotation = rotation_error_vector(found.cam_from_obj.R, np.broadcast_to(pose.R, (draws, 3, 3)))
    scatter = np.mean(np.hstack((rotation, found.cam_from_obj.t - pose.t)) ** 2, axis=0)
    stated = np.mean(np.diagonal(found.covariance, axis1=1, axis2=2), axis=0)
    # The scatter is good to sqrt(2 / 250) = 0.09. What is stated rests on 2 degrees of freedom with four points and 4
    # with five: its mean is good to sqrt(2 / 2 / 250) = 0.06 or better. 0.44 is four times both together. Counting the
    # 2 n coordinates as degrees of freedom, as if no pose had been fitted, gives 0.25 and 0.4.
    assert np.all(np.abs(stated / scatter - 1.0) < 0.44), stated / scatter


@pytest.mark.parametrize("robust", [False, True])
@pytest.mark.parametrize(("sag_mm", "told"), [(0.0, False), (3.0, True)])
def test_residuals_that_contradict_sigma_are_told(sag_mm, told, robust):
    """A sheet that is bent by 3 mm and taken for flat: the pose is tens of stated deviations off."""
    x, y = np.meshgrid(np.arange(10) * 30.0 - 135.0, np.arange(7) * 30.0 - 90.0)
    flat = np.stack((x.ravel(), y.ravel(), np.zeros(x.size)), axis=1)
    bent = flat + np.outer(1.0 - (flat[:, 0] / 135.0) ** 2, (0.0, 0.0, sag_mm))
    camera, pose, sigma = paper_camera("perspective"), helix_pose(30.0), 0.02
    exact = camera.project(pose.apply(bent))
    pixels = exact + sigma * np.random.default_rng(7).standard_normal((50, *exact.shape))
    for sigma_px in (sigma, np.full(len(flat), sigma), np.tile(sigma**2 * np.eye(2), (len(flat), 1, 1))):
        found = eposit.solve(flat, pixels, camera, sigma_px=sigma_px, robust=robust)
        single = eposit.solve(flat, pixels[0], camera, sigma_px=sigma_px, robust=robust)
        refused = robust and told  # more points disagree than robust may leave out
        assert set(found.status) == ({"inconsistent"} if refused else {"ok"})
        assert np.all(found.covariance_unreliable == told)
        assert single.covariance_unreliable == told
    assert not np.any(eposit.solve(flat, pixels, camera).covariance_unreliable)  # the residuals tell the scale
