"""A picture that moved while it was taken: its streak is seen, and the circle is where it was midway."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import shift

from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.circle import find_circle
from pipelines.detection.circle_blur import Blur, motion_blur
from pipelines.detection.circle_patch import _streak
from pipelines.detection.circle_pixels import _blurred, _smeared
from pipelines.detection.corner_sites import chessboard_sites
from render.targets.chessboard import Chessboard
from tests.drawn_boards import Drawing
from tests.pipelines.detection import test_circle as drawing
from tests.supersampled import digitised

DRAWING = Drawing(width=520, height=400, focal_px=260.0, angles_deg=(20.0, -15.0, 10.0))
TARGET = Chessboard()
LENGTH_PX = 6.0
# Of the picture's x. The board's rows run at about 10 degrees: along the first way the motion runs along a diagonal of
# its squares, and edges of both directions are widened alike.
WAYS_DEG = 55.0, 10.0


@functools.cache
def still():
    return DRAWING.linear()


def way_of(deg, length=LENGTH_PX):
    return length * np.array([np.cos(np.deg2rad(deg)), np.sin(np.deg2rad(deg))])


def streaked(image, deg, length=LENGTH_PX):
    """The mean of a picture at even steps of the way, which reaches as far to either side."""
    places = (np.arange(16) + 0.5) / 16.0 - 0.5
    return np.mean([shift(image, place * way_of(deg, length)[::-1], order=3, mode="nearest") for place in places], 0)


def moved(deg, length=LENGTH_PX):
    return digitised(streaked(still(), deg, length), np.random.default_rng(0), 0.5)


def seen_motion(image):
    at = grid(TARGET.inner)
    board = BoardMap.fit(at, DRAWING.truth()[:-1], image.shape[::-1], np.ones(len(at)))
    return motion_blur(image, board, chessboard_sites(TARGET))


@pytest.mark.parametrize("deg", WAYS_DEG)
def test_a_motion_is_seen_along_its_direction(deg):
    """What a gaussian says of a box is up to 6 % too much of its length, along the squares' diagonals."""
    streak = seen_motion(moved(deg)).streak
    expected = way_of(deg)
    assert np.linalg.norm(streak * np.sign(streak @ expected) - expected) < 0.08 * LENGTH_PX


def test_a_still_picture_and_one_that_hardly_moved_have_none():
    assert seen_motion(moved(0.0, 0.0)) is None
    assert seen_motion(moved(WAYS_DEG[0], 1.0)) is None


@pytest.mark.parametrize("deg", WAYS_DEG)
def test_the_circle_is_where_it_was_midway(deg):
    """With the motion its error is as stated; taken for a blur in all directions it lies 0.5 px off."""
    image, camera = drawing.board_with("far")
    truth, told = (
        drawing.project(camera, drawing.AT[None], drawing.HEIGHT)[0],
        replace(drawing.exact_corners(image, camera), noise=1.0),
    )
    near = slice(int(truth[1]) - 60, int(truth[1]) + 60), slice(int(truth[0]) - 60, int(truth[0]) + 60)
    image[near] = streaked(image[near], deg)
    picture = digitised(image, np.random.default_rng(0), 1.0)
    found = find_circle(
        picture, told, grid(drawing.TARGET.inner), drawing.TARGET, motion=Blur(drawing.EDGE_BLUR, way_of(deg))
    )
    off = found.centre_px - truth
    assert np.linalg.norm(off) < 0.05  # measured 0.025 and 0.013, of which noise makes 0.01
    assert off @ np.linalg.solve(found.covariance_px2, off) < 13.8  # 0.999 of two squares; measured 9.2


def test_a_motion_that_the_circle_does_not_show_is_left():
    """Lamps that flicker, reflections and noise make corners look as if the picture had moved."""
    image, camera = drawing.board_with("far")
    told = replace(drawing.exact_corners(image, camera), noise=1.0)
    picture = digitised(image, np.random.default_rng(0), 1.0)
    expected = find_circle(picture, told, grid(drawing.TARGET.inner), drawing.TARGET)
    found = find_circle(
        picture,
        told,
        grid(drawing.TARGET.inner),
        drawing.TARGET,
        motion=Blur(drawing.EDGE_BLUR, way_of(WAYS_DEG[0], 2.5)),
    )
    np.testing.assert_array_equal(found.centre_px, expected.centre_px)
    np.testing.assert_array_equal(found.covariance_px2, expected.covariance_px2)


def test_a_streak_spreads_light_by_its_own_variance_and_leaves_its_middle():
    streak = np.array([4.0, -2.5])
    point = np.zeros((41, 41))
    point[20, 20] = 1.0
    spread = _smeared(point, *_streak(Blur(0.7, streak), 3))
    y, x = np.mgrid[-20:21, -20:21] / 3.0
    mean = np.array([np.sum(spread * x), np.sum(spread * y)])
    across = np.array([[np.sum(spread * a * b) for a in (x, y)] for b in (x, y)])
    assert np.sum(spread) == pytest.approx(1.0)
    assert np.abs(mean).max() < 1e-12
    # Taps two cells apart, of which the outermost count by their share: a sixth of (2 / 3 px)^2 at most.
    assert np.abs(across - np.outer(streak, streak) / 12.0).max() < 0.08


@pytest.mark.parametrize(("finer", "taps"), [(2, 8), (2, 10), (2, 12), (3, 9), (3, 11), (3, 13)])
@pytest.mark.parametrize("count", [3, 20, 30])
def test_a_blur_at_pixels_is_the_sum_over_its_taps(finer, taps, count):
    """Of a grid that goes on as it ends, about the pixels' centres; four pixels at a time and three taps, or fewer."""
    rng = np.random.default_rng(count)
    fine, kernel = rng.random((5 * finer, 6 * finer)), rng.random(taps)
    rows, columns = (np.ascontiguousarray(part[:count]) for part in np.nonzero(np.ones((5, 6))))
    ended, first = np.pad(fine, taps, mode="edge"), taps + (finer - taps) // 2
    windows = np.lib.stride_tricks.sliding_window_view(ended, (taps, taps))[first::finer, first::finer]
    expected = np.einsum("nij,i,j->n", windows[rows, columns], kernel, kernel)
    assert np.allclose(_blurred(fine, kernel, finer, rows, columns), expected, rtol=1e-13)
