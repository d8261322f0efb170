"""What widens the stated errors of a board's corners, and what does not."""

import numpy as np
import pytest

from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.corner_scatter import scatter_about, scatter_of_neighbours

STATED = 0.01  # px, by the pixels of each corner
LENS = np.array([500.0, 0.0, 400.0, 300.0, 0.0, 0.0, 0.0])


def factors(noise, misfit=lambda x, y: (0.0 * x, 0.0 * y), inner=(9, 6), boards=20):
    """Mean factor of the variances over many boards, and the mean square distance from the map."""
    at = grid(inner)
    slopes = BoardMap(np.eye(3), np.array([-3.0, -2.0, 9.0]), LENS).slopes(at)
    covariance = np.repeat(STATED**2 * np.eye(2)[None], len(at), axis=0)
    rng, moved = np.random.default_rng(5), np.stack(misfit(*at.T), axis=1)
    missed = [moved + noise * rng.standard_normal(moved.shape) for _ in range(boards)]
    neighbours = [scatter_of_neighbours(at, one, covariance, slopes) for one in missed]
    return np.mean(neighbours), np.mean([scatter_about(slopes, one, covariance) for one in missed])


def test_noise_as_stated_leaves_the_covariance():
    # 54 corners leave about 70 degrees of freedom: 20 boards tell the mean of the factor to sqrt(2 / 70 / 20) = 0.04.
    assert factors(STATED)[0] == pytest.approx(1.0, abs=0.12)


def test_noise_above_what_is_stated_widens_it():
    """Nine times the variance from about 70 degrees of freedom, beside ten of the prior: (630 + 10) / 80 = 8."""
    assert factors(3.0 * STATED)[0] == pytest.approx(8.0, abs=1.0)


def test_what_alternates_from_corner_to_corner_widens_it():
    def alternating(x, y):
        sign = np.where((x + y) % 2 == 0, 1.0, -1.0)
        return 2.0 * STATED * sign, 2.0 * STATED * sign

    # No polynomial of degree 4 follows the sign on 9 x 6 corners: its 108 squares of 4 fall upon about 70 degrees of
    # freedom, and the prior's ten: (432 + 70 + 10) / 80 = 6.4.
    assert factors(STATED, alternating)[0] == pytest.approx(6.4, abs=0.9)


@pytest.mark.parametrize(
    "misfit",
    [
        lambda x, y: (0.02 * (x - 4.0) ** 2, 0.01 * (x - 4.0) * (y - 2.5)),  # a bend
        lambda x, y: (0.1 * np.sin(0.7 * y), 0.0 * y),  # a camera that shakes slowly
    ],
)
def test_what_neighbours_share_does_not_widen_it(misfit):
    neighbours, about = factors(STATED, misfit)
    assert about > 5.0
    assert neighbours == pytest.approx(1.0, abs=0.15)


def test_residuals_that_move_no_corner_narrow_it_but_not_to_nothing():
    """A hundredth of the stated variance: its power of 1 - 10 / 95 is 0.016."""
    assert 0.01 < factors(0.1 * STATED)[0] < 0.03


@pytest.mark.parametrize("noise", [0.1, 1.0])
def test_few_corners_hardly_narrow_it(noise):
    """Nine corners leave a few degrees of freedom, which tell next to nothing beside the prior's ten."""
    # Eighteen numbers, at least nine parameters of pose, focal length and lens: more than 10 / (9 + 10) is left.
    assert 0.52 < factors(noise * STATED, inner=(3, 3))[0] < 1.2


def test_a_smooth_misfit_is_no_reason_to_state_less():
    """Residuals that move no corner, and a bend that the map does not follow."""
    assert factors(0.1 * STATED, lambda x, y: (0.02 * (x - 4.0) ** 2, 0.0 * y))[0] == pytest.approx(1.0)
