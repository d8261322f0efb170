"""Rows that a shaking camera moves against each other: told from errors of the corners, and from bent boards."""

import numpy as np
import pytest

from pipelines.detection import PointStatus, corners, detect_points
from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.row_moves import row_moves
from render.targets.chessboard import Chessboard
from tests.drawn_boards import Drawing
from tests.pipelines.detection.test_finders import TARGET, drawn

AT, NOISE = grid((9, 6)), 0.003
PERIOD, LENS = 110.0, np.array([560.0, 0.0, 400.0, 300.0, 0.0, 0.0, 0.0])


def shake(rows):
    """(n,) px to the right."""
    return np.sin(2.0 * np.pi * rows / PERIOD)


def turned(deg):
    """The map of a board that lies before the camera, turned by an angle."""
    c, s = np.cos(np.deg2rad(deg)), np.sin(np.deg2rad(deg))
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return BoardMap(R, np.array([0.0, 0.0, 14.0]) - R @ [4.0, 2.5, 0.0], LENS)


def told(board, moved):
    """The moves that corners tell which lie off their map by `moved` (n, 2) px, and by noise."""
    points = board(AT) + moved + NOISE * np.random.default_rng(2).standard_normal((len(AT), 2))
    return row_moves(AT, points, np.repeat(NOISE**2 * np.eye(2)[None], len(AT), axis=0), board), points


def test_a_shake_of_some_rows_is_told_and_bends_edges():
    board = turned(20.0)
    moves, points = told(board, np.stack((shake(board(AT)[:, 1]), np.zeros(len(AT))), axis=1))
    rows, jacobian = points[:, 1], board.jacobian(AT)
    # An edge along the direction (c, s) is moved aside by c shake(row): half the second derivative along it.
    along = jacobian[:, :, ::-1] / np.linalg.norm(jacobian[:, :, ::-1], axis=1)[:, None]
    second = -((2.0 * np.pi / PERIOD) ** 2) * shake(rows)
    # The normal (c, s) of `normal_angles` has the tangent (-s, c).
    bends = 0.5 * second[:, None] * along[:, 1] ** 2 * along[:, 1]
    error = moves.bends(rows, jacobian) - bends
    # What noise of 0.003 px makes of a second derivative over 20 px is 1e-5 / px; waves that end add as much.
    assert np.sqrt(np.mean(error**2)) < 0.1 * np.sqrt(np.mean(bends**2))


def test_a_board_in_a_few_rows_tells_nothing_of_those_between():
    board = turned(0.0)
    assert told(board, np.stack((shake(board(AT)[:, 1]), np.zeros(len(AT))), axis=1))[0] is None


@pytest.mark.parametrize(
    "moved",
    [
        0.0 * AT,
        0.03 * (AT - 4.0) ** 2,  # a bend
        np.where((AT.sum(axis=1) % 2 == 0)[:, None], 0.5, -0.5) * np.ones(2),  # errors from corner to corner
        np.where(np.arange(len(AT)) == 21, 3.0, 0.0)[:, None] * np.ones(2),  # one wrong corner
    ],
    ids=["noise", "bend", "alternating", "wrong"],
)
def test_what_is_no_function_of_the_row_is_none(moved):
    assert told(turned(20.0), moved)[0] is None


class Shaken(Drawing):
    """Drawn with moved rows."""

    def grey(self, x, y):
        return super().grey(x - shake(y), y)

    def truth(self):
        points = super().truth()
        return points + np.stack((shake(points[:, 1]), np.zeros(len(points))), axis=1)


def test_corners_of_a_shaken_picture_are_found_with_the_errors_they_state():
    drawing = Shaken(angles_deg=(20.0, -15.0, 25.0))
    found = detect_points(drawing.image(), Chessboard())
    assert set(found.status[:-1]) == {"ok"}
    error = (found.points_px - drawing.truth())[:-1]
    # 0.007 px without a shake, by the drawing's cells of a third of a pixel; 0.02 with edges as a lens bends them.
    assert np.sqrt(np.mean(error**2)) < 0.013
    squares = np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.covariance_px2[:-1]), error)
    assert 0.7 < np.sqrt(0.5 * squares.mean()) < 2.5  # 0.05 if the shake is taken for errors, 2 by the cells


def test_moves_that_lose_corners_are_none(monkeypatch):
    """As in a photograph whose edges were sharpened beyond what any model of them holds: 45 of 49 corners were lost."""
    image, truth = drawn(30.0, 20.0, cells=4)
    board = turned(20.0)
    false, _ = told(board, np.stack((40.0 * shake(board(AT)[:, 1]), np.zeros(len(AT))), axis=1))
    monkeypatch.setattr(corners, "row_moves", lambda *given: false)
    found = detect_points(image, TARGET)
    assert set(found.status[:54]) == {PointStatus.OK}
    assert np.linalg.norm(found.points_px[:54] - truth, axis=1).max() < 0.05  # as without moves: 0.02 measured
