"""Pixels that are white or black whatever falls on them."""

import numpy as np

from pipelines.detection.board_map import BoardMap
from pipelines.detection.corner_sites import chessboard_sites
from pipelines.detection.corners import refine_corners
from pipelines.detection.hot_pixels import without_hot_pixels
from tests.pipelines.detection.test_finders import CORNERS, TARGET, drawn

POINTS = np.array([[20.0, 20.0], [80.0, 60.0]])


def noisy(shape, deviation):
    return 120.0 + deviation * np.random.default_rng(3).standard_normal(shape)


def test_a_single_pixel_is_replaced_where_the_board_lies():
    image = np.rint(noisy((100, 120), 2.0)).astype(np.uint8)
    image[40, 50], image[30, 70], image[99, 119] = 255, 0, 255  # the last is far from the board
    mended = without_hot_pixels(image, POINTS, 5.0)
    changed = np.argwhere(mended != image)
    np.testing.assert_array_equal(changed, [[30, 70], [40, 50]])
    assert np.all(np.abs(mended[[30, 40], [70, 50]] - 120.0) < 8.0)  # four deviations


def test_noise_and_edges_stay_as_they_are():
    for deviation in (0.0, 2.0, 20.0):
        image = noisy((100, 120), deviation)
        image[:, 60:] -= 100.0
        grey = np.clip(np.rint(image), 0, 255).astype(np.uint8)
        assert without_hot_pixels(grey, POINTS, 5.0) is grey


def test_no_corner_is_refused_for_hot_pixels():
    image, truth = drawn(30.0, 20.0, cells=6)
    spoiled, rng = image.copy(), np.random.default_rng(8)
    where = rng.uniform(size=image.shape)
    spoiled[where < 0.001] = 255
    board = BoardMap.fit(CORNERS, truth, image.shape[::-1], np.ones(54))
    found = refine_corners(spoiled, board, chessboard_sites(TARGET))
    # One corner in fourteen is refused where they stay, for residuals that no edge explains.
    assert found.consistent.all()
    assert np.sqrt(np.mean((found.points_px - truth) ** 2)) < 0.006  # measured 0.0033 px


def test_pixels_upon_edges_move_no_corner():
    """A black pixel upon an edge lies between the grey values of its neighbours: only the corner's model tells it."""
    image, truth = drawn(30.0, 20.0, cells=6)
    board = BoardMap.fit(CORNERS, truth, image.shape[::-1], np.ones(54))
    before = refine_corners(image, board, chessboard_sites(TARGET))
    spoiled = image.copy()
    for along in (0.15, 0.3):  # squares from each corner along both of its edges
        for x, y in np.rint(np.concatenate([board(CORNERS + step) for step in along * np.eye(2)])).astype(int):
            spoiled[y, x] = 0
    found = refine_corners(spoiled, board, chessboard_sites(TARGET))
    # While they take part, corners are 0.03 px off.
    assert found.consistent.all()
    assert np.sqrt(np.mean((found.points_px - truth) ** 2)) < 0.006  # as in a picture without any
    ratio = np.median(found.covariance_px2[:, 0, 0] / before.covariance_px2[:, 0, 0])
    assert 0.9 < ratio < 1.6  # of some 300 pixels, 4 of those that tell most are gone
