"""Corners against the map through the others, where the map follows the board and where it does not."""

import numpy as np
import pytest

from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.consistency import Corners, drop_inconsistent

AT, SIZE, NOISE = grid((9, 6)), (800, 600), 0.003
BOARD = BoardMap(np.eye(3), np.array([-4.0, -2.5, 14.0]), np.array([560.0, 0.0, 400.0, 300.0, 0.0, 0.0, 0.0]))


def checked(moved=lambda x, y: (0.0 * x, 0.0 * y), wrong=(), seed=0, unsure=()):
    """Which corners of a board are consistent.

    moved: px, smooth along the board. wrong: pairs of a corner and how far, px, it lies off along x. unsure: corners
    that state six times the deviation of the others.
    """
    return drawn(moved, wrong, seed, unsure).consistent


def drawn(moved, wrong, seed, unsure):
    points = BOARD(AT) + np.stack(moved(*AT.T), axis=1)
    points += NOISE * np.random.default_rng(seed).standard_normal(points.shape)
    for corner, off in wrong:
        points[corner, 0] += off
    covariance = np.repeat(NOISE**2 * np.eye(2)[None], len(AT), axis=0)
    covariance[list(unsure)] *= 36.0
    started = Corners(points, covariance, np.ones(len(AT), bool), 0.7, 200.0, BOARD)
    return drop_inconsistent(started, AT, SIZE)


def read_row_by_row(x, y):
    """As by a camera that turns faster and faster: no lens bends a board like that."""
    return 0.12 * (y - 2.5) ** 3, 0.12 * (x - 4.0) * (y - 2.5) ** 2


@pytest.mark.parametrize("seed", range(6))
def test_outermost_corners_of_a_board_that_the_map_does_not_follow_are_kept(seed):
    assert np.all(checked(read_row_by_row, seed=seed))


@pytest.mark.parametrize("corner", [0, 4, 22, 53])
def test_a_wrong_corner_of_such_a_board_falls_out(corner):
    assert np.flatnonzero(~checked(read_row_by_row, [(corner, 8.0)])).tolist() == [corner]


@pytest.mark.parametrize("corner", [0, 4, 22, 53])
def test_a_corner_a_quarter_of_a_pixel_off_a_sharp_map_falls_out(corner):
    assert np.flatnonzero(~checked(wrong=[(corner, 0.25)])).tolist() == [corner]


@pytest.mark.parametrize("corner", [0, 4, 22, 53])
def test_a_corner_that_states_more_may_lie_farther_off_and_states_it(corner):
    """Twelve median distances of 1.2 deviations, six times: 0.26 px; but no more than a quarter of 0.7 px blur."""
    found = drawn(lambda x, y: (0.0 * x, 0.0 * y), [(corner, 0.15)], 0, [corner])
    assert np.all(found.consistent)
    assert np.sqrt(np.trace(found.covariance_px2[corner])) == pytest.approx(0.15, rel=0.35)  # as in test_lone_errors
    assert np.flatnonzero(~checked(wrong=[(corner, 0.22)], unsure=[corner])).tolist() == [corner]


def test_two_wrong_neighbours_do_not_vouch_for_each_other():
    assert np.flatnonzero(~checked(wrong=[(0, 0.4), (1, 0.4)])).tolist() == [0, 1]
