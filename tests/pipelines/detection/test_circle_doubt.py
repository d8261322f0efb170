"""What a circle's stated error holds beyond that of its fit."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.special import ndtr

from pipelines.detection import circle, corner_blur
from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.circle import find_circle
from pipelines.detection.circle_doubt import RESIZED, at_least, beyond_the_fit, moved_edges, unexplained_size
from pipelines.detection.circle_light import fit_in_any_light
from pipelines.detection.circle_map import CORNER_PX, FARTHER, LENS_SPREAD, prediction_covariance
from tests.pipelines.detection import test_circle as drawing
from tests.supersampled import digitised

COVARIANCE = np.array([[4e-4, 1e-4], [1e-4, 9e-4]])  # px^2
SURE = np.eye(2) * 1e-6  # px^2, of a corner


def along(covariance, way):
    way = way / np.linalg.norm(way)
    return float(way @ covariance @ way)


def test_the_error_is_no_smaller_than_the_way_to_the_maps_size():
    resized = np.array([0.03, -0.04])
    widened = at_least(COVARIANCE, resized)
    assert math.isclose(along(widened, resized), (RESIZED * 0.05) ** 2)
    aside = np.array([0.04, 0.03])
    assert math.isclose(along(widened, aside), along(COVARIANCE, aside))


@pytest.mark.parametrize("resized", [np.zeros(2), np.array([0.003, -0.004])])
def test_an_error_that_holds_it_already_stays(resized):
    assert np.allclose(at_least(COVARIANCE, resized), COVARIANCE, rtol=1e-12, atol=0.0)


def test_a_size_that_the_map_or_sharpening_explains_says_nothing():
    assert unexplained_size(0.0004, 0.0, 0.0) == 0.0
    assert unexplained_size(-0.004, 0.01, 0.0) == 0.0
    assert unexplained_size(-0.004, 0.0, 0.03) == 0.0
    assert math.isclose(unexplained_size(-0.004, 0.0, 0.0), 0.0035)


def test_noise_in_the_edges_widths_is_not_taken_for_sharpening():
    """In a faint picture corners are unsure by 0.05 px and edges' widths by 0.2; beside sure corners this tells."""
    quiet, none = np.zeros(2), (0.0, 0.0)
    faint, seen = np.eye(2) * 0.05**2, (0.05, -0.2)

    def added(corners, beyond):
        return beyond_the_fit(quiet, corners, beyond, 0.0, 0.0, 15.0)

    assert np.allclose(added(faint, seen), added(faint, none))
    assert added(SURE, seen)[0, 0] > 4.0 * added(SURE, none)[0, 0]


def widths(monkeypatch, scatter):
    """What edges seem to be wider by that are 0.3 px wider than a blur of 1 px, and scatter by so many px."""
    away = np.linspace(-14.0, 14.0, 113)
    px = np.sqrt(1.0 + corner_blur.SAMPLING) + 0.3 + scatter * np.tile([-1.0, -0.5, 0.0, 0.5, 1.0, 0.0], 6)
    shares, step = ndtr(away / px[:, None]), np.full(len(px), away[1] - away[0])
    profiles = corner_blur.EdgeProfiles(
        shares, step, np.ones(len(px), bool), np.arange(len(px)) % 12 < 6, shares[:, :2]
    )
    monkeypatch.setattr(corner_blur, "edge_profiles", lambda *picture: profiles)
    return corner_blur.widths_beyond(np.zeros((2, 2), np.float32), None, None, 1.0)


def test_widths_that_differ_from_edge_to_edge_are_not_told(monkeypatch):
    """As waves of light make them. 18 edges that scatter by 0.7 px tell their median to 0.22 px."""
    assert np.allclose(widths(monkeypatch, 0.0), 0.3, atol=0.01)
    assert np.all(widths(monkeypatch, 0.7) == 0.0)


def test_what_corners_show_beyond_the_circle_moves_it():
    """Twice the circle's variance may be chance; more is a filter that a blur does not describe, up to four times."""
    assert moved_edges(2.0, 1.0, 1.0, 150.0, 0.8) == 0.0
    assert math.isclose(moved_edges(3.0, 1.0, 1.0, 150.0, 0.8), math.sqrt(2.0 * math.pi) * 0.8 / 150.0)
    assert moved_edges(9.0, 1.0, 1.0, 150.0, 0.8) == moved_edges(4.0, 1.0, 1.0, 150.0, 0.8)
    assert moved_edges(9.0, 1.0, 0.4, 150.0, 0.8) == 0.0  # in ordinary pictures of a noisy sensor it is 0.2 to 0.53
    none, odd = (beyond_the_fit(np.zeros(2), SURE, (0.0, 0.0), 0.0, px, 15.0) for px in (0.0, 0.1))
    assert np.allclose(odd - none, 0.025**2 * np.eye(2))


def changed(board, which, by):
    """The map with one number of its pose or lens changed."""
    turn, t, lens = np.zeros(3), board.t.copy(), board.lens.copy()
    (turn, t, lens)[min(which // 3, 2)][which if which < 3 else which - 3 if which < 6 else which - 6] += by
    return BoardMap(board.R @ Rotation.from_rotvec(turn).as_matrix(), t, lens)


@pytest.mark.parametrize("name", drawing.VIEWS)
def test_how_sure_the_map_is_of_a_circles_size_is_what_all_maps_like_it_say(name):
    """The covariance of all numbers of the map, whose slopes are differences here, carried to the size."""
    at, size = grid(drawing.TARGET.inner), (drawing.WIDTH, drawing.TALL)
    seen = drawing.project(drawing.view(name), at, 0.0)
    board = BoardMap.fit(at, seen, size, np.ones(len(seen)))
    steps = np.concatenate((np.full(6, 1e-5), 1e-5 * np.array([board.lens[0], 1.0, *size, 1.0, 1.0, 1.0])))

    def log_size(board):
        return 0.5 * math.log(abs(np.linalg.det(board.jacobian(drawing.AT, drawing.HEIGHT))))

    slopes, growth = np.empty((2 * len(at), 13)), np.empty(13)
    for which, step in enumerate(steps):
        more, less = (changed(board, which, sign * step) for sign in (1.0, -1.0))
        slopes[:, which] = (more(at) - less(at)).ravel() / (2.0 * step * CORNER_PX)
        growth[which] = (log_size(more) - log_size(less)) / (2.0 * step)
    usual = np.array([0.0, (size[0] - 1) / 2.0, (size[1] - 1) / 2.0, 0.0, 0.0, 0.0])
    spread = np.maximum(LENS_SPREAD, FARTHER * np.abs(board.lens[1:] - usual))
    known = np.diag(np.append(np.zeros(7), 1.0 / spread))
    expected = math.sqrt(growth @ np.linalg.inv(slopes.T @ slopes + known.T @ known) @ growth)
    told = prediction_covariance(board, drawing.TARGET, size[::-1])[2, 2]
    assert abs(math.sqrt(told) / expected - 1.0) < 0.02  # by differences


@pytest.mark.full
def test_a_fit_that_did_not_converge_gives_way_to_one_that_did(monkeypatch):
    """Where the place is unsure, the circle is fitted from the prediction and from the best place around it."""
    image, camera = drawing.board_with("far")
    told = drawing.exact_corners(image, camera)
    monkeypatch.setattr(circle, "SURE_SHARE", 0.0)
    picture = digitised(image, np.random.default_rng(0), 1.0)
    expected = find_circle(picture, told, grid(drawing.TARGET.inner), drawing.TARGET)
    for lost in (0, 1):
        fits = []

        def one_fails(*args, lost=lost, fits=fits):
            fits.append(fit_in_any_light(*args))
            return replace(fits[-1], converged=len(fits) - 1 != lost)

        monkeypatch.setattr(circle, "fit_in_any_light", one_fails)
        found = find_circle(picture, told, grid(drawing.TARGET.inner), drawing.TARGET)
        assert len(fits) == 2
        away = found.centre_px - expected.centre_px
        # One and a half stated deviations; measured 0.8. The fits read other pixels around the circle.
        assert away @ np.linalg.solve(expected.covariance_px2, away) < 2.25
