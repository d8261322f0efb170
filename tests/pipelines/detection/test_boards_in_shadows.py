"""Boards in stripes of shadow, as of blinds: their edges make points on the margin that look like corners."""

import functools

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from pipelines.detection import board_size, detect_points, lattice_finder
from pipelines.detection.board_map import BoardMap
from pipelines.detection.border_lines import Line, corner_places, goes_on, share_of_corners
from pipelines.detection.lattice_grid import Grid
from pipelines.detection.levels import LevelOf
from render.targets.chessboard import Chessboard
from render.targets.plain_chessboard import PlainChessboard
from tests.drawn_boards import Drawing
from tests.supersampled import digitised

BASE = {"width": 640, "height": 480, "focal_px": 340.0, "distance": 9.0, "cells": 2}
WITH_CIRCLE, PLAIN = Drawing(**BASE), Drawing(**BASE, circle=None)
# Direction of the stripes' normal, degrees; their period, px; light that is left. Without looking at whether squares
# go on, all of these are `other_board`.
STRIPES = [(150.0, 47.0, 0.5), (62.0, 47.0, 0.35), (62.0, 60.0, 0.25)]
MOST_NORM = 1.5  # of the errors over those stated: 1.3 for the deepest, where some corners have a shadow's edge on them


def drawing_for(kind):
    return WITH_CIRCLE if kind is Chessboard else PLAIN


@functools.cache
def linear(drawing):
    return drawing.linear()


def in_stripes(drawing, turn, period, left):
    """Picture of a drawing under stripes of shadow with soft edges."""
    y, x = np.mgrid[: drawing.height, : drawing.width]
    across = np.cos(np.deg2rad(turn)) * x + np.sin(np.deg2rad(turn)) * y
    shadow = gaussian_filter((across % period < 0.5 * period).astype(float), 1.0)
    lit = linear(drawing) * (1.0 - (1.0 - left) * shadow)
    return digitised(lit, np.random.default_rng(0), drawing.noise)


@pytest.mark.parametrize("stripes", STRIPES)
@pytest.mark.parametrize("kind", [Chessboard, PlainChessboard])
def test_a_board_in_stripes_of_shadow_is_found(kind, stripes):
    drawing = drawing_for(kind)
    found = detect_points(in_stripes(drawing, *stripes), kind())
    good = found.status == "ok"
    assert np.mean(good) > 0.9
    away = (found.points_px - drawing.truth())[good]
    normalised = np.einsum("ni,nij,nj->n", away, np.linalg.inv(found.covariance_px2[good]), away)
    assert np.sqrt(np.mean(normalised) / 2.0) < MOST_NORM


@pytest.mark.parametrize("stripes", STRIPES)
@pytest.mark.parametrize(("columns", "rows"), [(11, 7), (10, 8), (9, 7), (10, 6)])
@pytest.mark.parametrize("kind", [Chessboard, PlainChessboard])
def test_there_a_board_of_another_size_is_none(kind, columns, rows, stripes):
    found = detect_points(in_stripes(drawing_for(kind), *stripes), kind(columns=columns, rows=rows))
    assert not np.any(found.status == "ok")


@pytest.mark.parametrize("left", [0.5, 0.35, 0.25, 0.1])
def test_there_a_mirrored_board_is_none(left):
    image = in_stripes(WITH_CIRCLE, 62.0, 47.0, left)
    assert not np.any(detect_points(np.ascontiguousarray(image[:, ::-1]), Chessboard()).status == "ok")


@pytest.fixture(scope="module")
def board():
    """Grey values of a board in deep stripes, and the map from column and row to the picture."""
    places, size = PLAIN.corners[:, :2], (PLAIN.width, PLAIN.height)
    image = in_stripes(PLAIN, 62.0, 60.0, 0.25).astype(np.float32)
    return image, BoardMap.fit(places, PLAIN.truth(), size, np.ones(len(places)))


@pytest.mark.parametrize("axis", [0, 1])
def test_around_corners_squares_go_on(board, axis):
    for place in range((9, 6)[axis]):
        for out in (-1, 1):
            assert np.all(corner_places(*board, Line(axis, place, out, 0, (5, 8)[axis]), white_first=False) == 1.0)


@pytest.mark.parametrize(("axis", "place", "out"), [(0, -1, -1), (0, 9, 1), (1, -1, -1), (1, 6, 1)])
def test_beyond_a_border_they_do_not(board, axis, place, out):
    line = Line(axis, place, out, 0, (5, 8)[axis])
    assert share_of_corners(corner_places(*board, line, white_first=False)) < 0.4
    assert not goes_on(*board, line, white_first=False)


def test_too_few_places_in_view_say_nothing(board):
    light, whole = board
    assert share_of_corners(corner_places(light, whole, Line(0, 4, 1, 0, 2), white_first=False)) is None
    assert np.all(np.isnan(corner_places(light[:40], whole, Line(0, 4, 1, 0, 5), white_first=False)))


def test_a_lattice_of_which_no_line_is_a_board_s_is_left():
    """Of a texture every line may be dropped: the work ends before none is left."""
    target = PlainChessboard(columns=9, rows=3)
    y, x = np.mgrid[0:12, 0:2]
    points = np.stack((30.0 * x + 40.0, 30.0 * y + 40.0), axis=-1)
    level = LevelOf(np.zeros((460, 300), np.float32), 1.0, np.zeros(2))
    part = lattice_finder._without_end_lines(level, Grid(points, white_first=False), target)
    assert np.sum(part.known) < 2 * 12


def test_squares_that_go_on_across_a_line_are_none_of_the_board():
    """A lattice half a square aside has its lines in the middle of squares."""
    places, size = PLAIN.corners[:, :2], (PLAIN.width, PLAIN.height)
    aside = BoardMap.fit(places + [0.0, 0.5], PLAIN.truth(), size, np.ones(len(places)))
    light, line = linear(PLAIN).astype(np.float32), Line(1, 3, 1, 0, 8)
    told = [board_size._contradicts(light, aside, line, exchanged, is_end=False) for exchanged in (False, True)]
    assert told.count(True) == 1  # in the other colours no square is as it must be


def test_a_larger_board_with_a_part_of_its_last_line_covered_is_none():
    image, truth = PLAIN.image(), PLAIN.truth().reshape(6, 9, 2)
    low, high = truth[:2, 8].min(axis=0), truth[:2, 8].max(axis=0)
    image[int(low[1]) - 25 : int(high[1]) + 5, int(low[0]) - 14 : int(high[0]) + 60] = 120
    assert not np.any(detect_points(image, PlainChessboard(columns=9)).status == "ok")
