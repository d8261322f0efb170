"""Boards of which the picture shows a part, or another board: corners have their own numbers, or a status says why."""

import cv2
import numpy as np
import pytest

from pipelines.detection import detect_points
from pipelines.detection.finders import find_board
from pipelines.detection.statuses import PointStatus
from render.targets.chessboard import Chessboard
from render.targets.plain_chessboard import PlainChessboard
from tests.drawn_boards import Drawing

TARGET, PLAIN = Chessboard(), PlainChessboard(margin_mm=100.0)
BASE = {"width": 480, "height": 360, "focal_px": 260.0, "distance": 9.0, "cells": 2}
IN_PART = BASE | {"circle": None, "distance": 8.0, "angles_deg": (10.0, -5.0, 5.0)}
ROUGH_PX = 6.0  # the finder is good to a pixel, or to four beside what crops or covers the board; others are 20 px away


def numbered(image, target, truth):
    """The finder's ids, after it was seen that each is the corner that it says."""
    seen = find_board(image, target)
    assert not isinstance(seen, PointStatus), seen
    assert np.linalg.norm(seen.points_px - truth[seen.ids], axis=1).max() < ROUGH_PX
    return seen.ids


def in_view(drawing, margin=4.0):
    truth = drawing.truth()[: len(drawing.corners)]
    return np.all((truth > margin) & (truth < np.array([drawing.width, drawing.height]) - 1.0 - margin), axis=1)


AWAY = {(-9.0, 0.0): 10.0, (9.0, 1.0): 190.0, (0.0, -5.8): 100.0}  # angle that crops the side with the circle, by shift
IN_VIEW = [(shift, angle) for shift, away in AWAY.items() for angle in (10.0, 100.0, 190.0, 280.0) if angle != away]


@pytest.mark.parametrize(("shift", "angle"), IN_VIEW)
def test_corners_of_a_cropped_board_keep_their_numbers(shift, angle):
    """By the circle, or by the place where a mirrored board would have it."""
    drawing = Drawing(shift=shift, angles_deg=(20.0, -15.0, angle), **BASE)
    inside = in_view(drawing)
    assert inside.mean() > 0.4
    ids = numbered(drawing.image(), TARGET, drawing.truth())
    assert np.mean(np.isin(np.flatnonzero(inside), ids)) > 0.9


def test_points_of_a_cropped_board_are_ok_and_the_others_are_not_found():
    drawing = Drawing(shift=(8.0, 0.0), **BASE)
    found, truth, inside = detect_points(drawing.image(), TARGET), drawing.truth(), in_view(drawing)
    ok = found.status[:-1] == "ok"
    assert np.mean(ok[inside]) > 0.9
    assert set(found.status[:-1][~ok & ~inside]) <= {"point_not_found", "corners_inconsistent"}
    assert np.isnan(found.points_px[:-1][~ok]).all()
    # Two cells to a pixel put an edge off by up to a quarter of a pixel, here and there; another corner is 25 px away.
    assert np.linalg.norm((found.points_px - truth)[:-1][ok], axis=1).max() < 0.3


def test_a_part_that_could_lie_anywhere_on_the_board_is_ambiguous():
    """No side of the board in view, nor the circle."""
    drawing = Drawing(width=270, height=200, focal_px=260.0, distance=6.0, angles_deg=(5.0, 5.0, 3.0), cells=2)
    assert set(detect_points(drawing.image(), TARGET).status) == {"orientation_ambiguous"}


@pytest.mark.parametrize("middle", [0, 22, 31, 53])
def test_a_covered_board_keeps_the_other_corners(middle):
    drawing = Drawing(**BASE)
    truth, image = drawing.truth(), drawing.image()
    x, y = (int(v) for v in np.rint(truth[middle]))
    cv2.ellipse(image, (x, y), (22, 60), 30.0, 0.0, 360.0, 120, -1)
    covered = image[tuple(np.rint(truth[:-1]).astype(int).T[::-1])] == 120
    assert 1 < covered.sum() < 20
    found = detect_points(image, TARGET)
    ok = found.status[:-1] == "ok"
    assert np.mean(ok[~covered]) > 0.75  # those beside the cover are spoiled, too
    assert np.linalg.norm((found.points_px - truth)[:-1][ok], axis=1).max() < 0.3


def test_a_board_in_two_parts_is_one():
    """A bar covers whole columns: what lies beyond is found where the map from the rest puts it."""
    drawing = Drawing(angles_deg=(0.0, 0.0, 0.0), **BASE)
    image, truth = drawing.image(), drawing.truth()
    left = int(truth[4, 0]) - 12
    image[:, left : left + 24] = 90
    ids = numbered(image, TARGET, truth)
    assert {0, 1, 2, 6, 7, 8} <= set((ids % 9).tolist())


def test_glare_on_a_corner_of_the_board_leaves_the_others():
    drawing = Drawing(**BASE)
    truth = drawing.truth()
    y, x = np.mgrid[0 : drawing.height, 0 : drawing.width]
    glare = 900.0 * np.exp(-0.5 * ((x - truth[53, 0]) ** 2 + (y - truth[53, 1]) ** 2) / 20.0**2)
    ids = numbered(np.clip(drawing.linear() + glare, 0, 255).astype(np.uint8), TARGET, truth)
    assert 53 not in ids
    assert 30 <= len(ids) < 54


@pytest.mark.parametrize("angle", [0.0, 90.0, 200.0])
def test_a_mirrored_board_says_so(angle):
    drawing = Drawing(angles_deg=(15.0, -10.0, angle), **BASE)
    image = np.ascontiguousarray(drawing.image()[:, ::-1])
    assert set(detect_points(image, TARGET).status) == {"mirrored"}


def test_a_mirrored_board_in_part_says_so():
    drawing = Drawing(shift=(8.0, 0.0), **BASE)  # the side away from the circle is cropped
    assert set(detect_points(np.ascontiguousarray(drawing.image()[:, ::-1]), TARGET).status) == {"mirrored"}


@pytest.mark.parametrize("is_mirrored", [False, True])
@pytest.mark.parametrize("shift", AWAY)
def test_without_the_side_of_the_circle_a_mirrored_board_looks_the_same(shift, is_mirrored):
    image = Drawing(shift=shift, angles_deg=(20.0, -15.0, AWAY[shift]), **BASE).image()
    seen = find_board(np.ascontiguousarray(image[:, ::-1]) if is_mirrored else image, TARGET)
    assert seen == PointStatus.ORIENTATION_AMBIGUOUS


@pytest.mark.parametrize(("grey", "radius"), [(120, 20), (20, 20), (120, 40)])
def test_a_covered_circle_is_told_by_the_square_that_has_none(grey, radius):
    """A board whose circle is covered has none where a mirrored board would have it; a mirrored one is never ok."""
    drawing = Drawing(angles_deg=(15.0, -10.0, 0.0), **BASE)
    image, truth = drawing.image(), drawing.truth()
    x, y = (int(v) for v in np.rint(truth[-1]))
    cv2.circle(image, (x, y), radius, grey, -1)
    numbered(image, TARGET, truth)
    mirrored = find_board(np.ascontiguousarray(image[:, ::-1]), TARGET)
    assert mirrored in (PointStatus.MIRRORED, PointStatus.ORIENTATION_AMBIGUOUS)


def test_a_board_that_is_its_own_mirror_image_is_no_mirrored_one():
    drawing = Drawing(circle=(1, 4), **BASE)
    numbered(drawing.image(), Chessboard(circle_square=(1, 4)), drawing.truth())


@pytest.mark.parametrize("target", [Chessboard(columns=8), PlainChessboard(columns=8), PlainChessboard(rows=8)])
def test_a_board_of_another_size_is_another_board(target):
    assert set(detect_points(Drawing(**BASE).image(), target).status) == {"other_board"}


@pytest.mark.parametrize("angle", [0.0, 170.0])
@pytest.mark.parametrize(("columns", "rows"), [(8, 8), (9, 7), (8, 6), (4, 4)])
def test_the_circle_tells_the_orientation_of_squares_that_do_not(columns, rows, angle):
    drawing = Drawing(columns=columns, rows=rows, angles_deg=(20.0, -15.0, angle), **BASE)
    ids = numbered(drawing.image(), Chessboard(columns=columns, rows=rows), drawing.truth())
    assert len(ids) == (columns - 1) * (rows - 1)


def test_without_the_circle_their_orientation_is_ambiguous():
    drawing = Drawing(columns=9, rows=7, circle=None, **BASE)
    assert set(detect_points(drawing.image(), Chessboard(columns=9, rows=7)).status) == {"orientation_ambiguous"}


@pytest.mark.parametrize(("columns", "rows"), [(4, 4), (8, 6), (9, 7), (7, 6)])
def test_a_plain_board_that_looks_the_same_after_half_a_turn_is_read_upright(columns, rows):
    drawing = Drawing(columns=columns, rows=rows, circle=None, angles_deg=(20.0, -15.0, 30.0), **BASE)
    ids = numbered(drawing.image(), PlainChessboard(columns=columns, rows=rows), drawing.truth())
    assert len(ids) == (columns - 1) * (rows - 1)


@pytest.mark.parametrize(("columns", "rows"), [(8, 6), (9, 7)])
@pytest.mark.parametrize("angle", [30.0, 210.0])
def test_a_plain_board_with_a_white_first_square_is_found(columns, rows, angle):
    """Half a turn changes nothing in its picture, so that it is read upright, as other boards of that kind are."""
    drawing = Drawing(columns=columns, rows=rows, circle=None, exchanged=True, angles_deg=(20.0, -15.0, angle), **BASE)
    found = detect_points(drawing.image(), PlainChessboard(columns=columns, rows=rows))
    truth = drawing.truth() if angle < 90.0 else drawing.truth()[::-1]
    assert set(found.status) == {"ok"}
    # Two cells to a pixel put an edge off by up to a quarter of a pixel, here and there; another corner is 25 px away.
    assert np.linalg.norm(found.points_px - truth, axis=1).max() < 0.3


@pytest.mark.parametrize("exchanged", [False, True])
@pytest.mark.parametrize(("columns", "rows", "shift"), [(8, 6, (-9.0, 6.0)), (9, 7, (8.0, 0.0))])
def test_a_part_is_told_by_its_margin_whatever_the_first_square(columns, rows, shift, exchanged):
    drawing = Drawing(columns=columns, rows=rows, shift=shift, exchanged=exchanged, **IN_PART)
    found = detect_points(drawing.image(), PlainChessboard(columns=columns, rows=rows, margin_mm=100.0))
    ok = found.status == "ok"
    assert 0.5 < ok.mean() < 1.0
    assert np.linalg.norm((found.points_px - drawing.truth())[ok], axis=1).max() < 0.3


@pytest.mark.parametrize("exchanged", [False, True])
@pytest.mark.parametrize(("columns", "rows"), [(8, 6), (9, 7)])
def test_colours_alone_do_not_tell_a_part_where_boards_are_printed_in_two_ways(columns, rows, exchanged):
    """A corner of the board: it is another one if the first square is white."""
    drawing = Drawing(columns=columns, rows=rows, shift=(10.0, -6.0), exchanged=exchanged, **IN_PART)
    found = detect_points(drawing.image(), PlainChessboard(columns=columns, rows=rows, margin_mm=100.0))
    assert set(found.status) == {"orientation_ambiguous"}


@pytest.mark.parametrize(("columns", "rows"), [(8, 6), (9, 7)])
def test_of_a_board_with_a_circle_the_first_square_is_black(columns, rows):
    drawing = Drawing(columns=columns, rows=rows, circle=None, exchanged=True, **BASE)
    assert set(detect_points(drawing.image(), Chessboard(columns=columns, rows=rows)).status) == {"other_board"}


def test_a_plain_board_in_part_is_told_by_its_margin():
    drawing = Drawing(shift=(8.0, 0.5), circle=None, **BASE)
    numbered(drawing.image(), PLAIN, drawing.truth())


def test_a_board_without_a_margin_is_found_whole():
    drawing = Drawing(margin=0.0, circle=None, **BASE)
    ids = numbered(drawing.image(), PlainChessboard(margin_mm=0.0), drawing.truth())
    assert len(ids) == 54
