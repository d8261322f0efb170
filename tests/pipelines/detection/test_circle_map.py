"""What the errors of corners do to the form of a circle, and to its edge, against differences of maps."""

import numpy as np
import pytest

from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.circle_map import FARTHER, LENS_SPREAD, map_errors
from pipelines.detection.consistency import Corners
from tests.pipelines.detection import test_circle as drawing
from tests.pipelines.detection.test_circle_doubt import changed

SIZE = (drawing.WIDTH, drawing.TALL)
TURNS = np.arange(360) * (2.0 * np.pi / 360.0)
OUT = np.stack((np.cos(TURNS), np.sin(TURNS)), axis=1)


def rim_of(board):
    """(360, 2) px of the circle's edge, from its centre."""
    return board(drawing.AT + drawing.RADIUS * OUT, drawing.HEIGHT) - board(drawing.AT, drawing.HEIGHT)


@pytest.mark.parametrize("name", drawing.VIEWS)
def test_what_is_stated_follows_from_the_corners_own_covariances(name):
    """The edge's waves once and twice around, of maps that differ in one number, and the covariance of all numbers."""
    at, rng = grid(drawing.TARGET.inner), np.random.default_rng(0)
    points = drawing.project(drawing.view(name), at, 0.0)
    board = BoardMap.fit(at, points, SIZE, np.ones(len(at)))
    spread = 10.0 ** rng.uniform(-3.0, -1.0, len(at))  # px: some corners are sure, others are not
    corners = Corners(points, spread[:, None, None] ** 2 * np.eye(2), np.ones(len(at), bool), 0.8, 185.0, board)
    to_radii = np.linalg.inv(board.jacobian(drawing.AT, drawing.HEIGHT) * drawing.RADIUS)
    slopes, waves = np.empty((2 * len(at), 13)), np.empty((4, 13))
    steps = np.concatenate((np.full(6, 1e-5), 1e-5 * np.array([board.lens[0], 1.0, *SIZE, 1.0, 1.0, 1.0])))
    for which, step in enumerate(steps):
        more, less = (changed(board, which, sign * step) for sign in (1.0, -1.0))
        slopes[:, which] = ((more(at) - less(at)) / (2.0 * step * spread[:, None])).ravel()
        out = np.sum((rim_of(more) - rim_of(less)) @ to_radii.T * OUT, axis=1) / (2.0 * step)
        waves[:, which] = [2.0 * np.mean(out * wave(k * TURNS)) for k in (1, 2) for wave in (np.cos, np.sin)]
    usual = np.array([0.0, (SIZE[0] - 1) / 2.0, (SIZE[1] - 1) / 2.0, 0.0, 0.0, 0.0])
    known = np.append(np.zeros(7), np.maximum(LENS_SPREAD, FARTHER * np.abs(board.lens[1:] - usual)) ** -2.0)
    expected = waves @ np.linalg.inv(slopes.T @ slopes + np.diag(known)) @ waves.T
    told = map_errors(corners, at, drawing.TARGET, SIZE[::-1])
    # The slopes are differences here.
    np.testing.assert_allclose(told.form, np.sqrt(np.diag(expected)[2:]), rtol=0.03)
    np.testing.assert_allclose(told.shift, expected[:2, :2], rtol=0.06, atol=0.06 * np.trace(expected[:2, :2]))
