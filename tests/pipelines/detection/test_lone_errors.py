"""Corners of a board that lie farther from where the others put them than they state."""

import numpy as np
import pytest

from pipelines.detection.lone_errors import stated_errors

Y, X = np.mgrid[0:6, 0:9]
AT = np.stack((X.ravel(), Y.ravel()), axis=1).astype(float)
SIGMA = 0.01
STATED = np.repeat(SIGMA**2 * np.eye(2)[None], len(AT), axis=0)
SLOPES = np.einsum("nt,ck->nctk", np.stack((np.ones(54), *AT.T), axis=1), np.eye(2)).reshape(54, 2, 6)  # affine


def noise(seed):
    return SIGMA * np.random.default_rng(seed).standard_normal(AT.shape)


@pytest.mark.parametrize("corner", [0, 13, 31])
def test_a_corner_far_from_the_others_states_its_distance(corner):
    missed = noise(corner)
    expected, before = stated_errors(AT, missed, STATED, SLOPES)
    missed[corner] += [0.1, -0.05]
    stated, factor = stated_errors(AT, missed, STATED, SLOPES)
    # What the others say of it is good to a few deviations, a fifth of its distance.
    assert np.sqrt(np.trace(stated[corner])) == pytest.approx(np.hypot(0.1, 0.05), rel=0.35)
    assert missed[corner] @ np.linalg.solve(stated[corner], missed[corner]) < 4.0
    # One of 54 corners less tells the scatter; with it in, the factor would be twice as large.
    assert factor == pytest.approx(before, rel=0.15)
    np.testing.assert_allclose(np.delete(stated, corner, 0), np.delete(expected, corner, 0), rtol=0.15)


def test_two_neighbours_that_are_far_off_do_not_hide_each_other():
    missed = noise(3)
    missed[[21, 22]] += [[0.1, 0.0], [0.0, -0.1]]
    stated, _ = stated_errors(AT, missed, STATED, SLOPES)
    assert set(np.flatnonzero(np.trace(stated, axis1=1, axis2=2) > 8.0 * SIGMA**2)) == {21, 22}


def test_noise_and_a_bent_board_are_no_lone_errors():
    """A limit of 20 is passed by one of 20000 corners; these are 1080."""
    bent = 0.3 * np.stack(((AT[:, 0] - 4.0) ** 2, AT[:, 0] * AT[:, 1]), axis=1) / 16.0
    for seed in range(20):
        stated, factor = stated_errors(AT, noise(seed) + bent, STATED, SLOPES)
        np.testing.assert_allclose(stated, factor * STATED)


def test_where_few_corners_tell_nothing_of_each_other_they_have_one_factor():
    few = AT[AT.max(axis=1) < 3]
    missed = np.full((len(few), 2), 0.01)
    missed[4] = 0.2
    stated, factor = stated_errors(few, missed, STATED[: len(few)], SLOPES[AT.max(axis=1) < 3])
    np.testing.assert_allclose(stated, factor * STATED[: len(few)])
