"""Boards in pictures of many kinds: colour, 16 bits, dim, overexposed, blurred, noisy, compressed, large."""

import cv2
import numpy as np
import pytest

from pipelines.detection import detect_points
from pipelines.detection.finders import find_board
from pipelines.detection.grey_picture import grey_picture
from pipelines.detection.statuses import PointStatus
from render.targets.aprilgrid import AprilGrid
from render.targets.charuco import Charuco
from render.targets.chessboard import Chessboard
from render.targets.circle_grid import CircleGrid
from render.targets.plain_chessboard import PlainChessboard
from tests.drawn_boards import Drawing

TARGET = Chessboard()
BASE = {"width": 480, "height": 360, "focal_px": 260.0, "distance": 9.0, "cells": 2}


@pytest.fixture(scope="module")
def usual():
    """A board's picture as grey levels, and as 8 bits."""
    drawing = Drawing(**BASE)
    return drawing.linear(), drawing.image()


def jpeg(image, quality):
    return cv2.imdecode(cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_GRAYSCALE)


def sharpened(image):
    soft = cv2.GaussianBlur(image, (0, 0), 1.0)
    return np.clip(np.rint(3.0 * image - 2.0 * soft), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("order", ["red first", "blue first", "opacity", "one channel"])
def test_colour_is_read_as_grey(usual, order):
    grey = usual[1]
    blue = (0.9 * grey).astype(np.uint8)
    channels = {
        "red first": [grey, grey, blue],
        "blue first": [blue, grey, grey],
        "opacity": [grey, grey, blue, np.zeros_like(grey)],
        "one channel": [grey],
    }[order]
    found = detect_points(np.stack(channels, axis=-1), TARGET)
    assert np.mean(found.status == "ok") > 0.9
    expected = detect_points(grey, TARGET)
    assert np.nanmax(np.abs(found.points_px - expected.points_px)) < 0.1


def test_red_first_and_blue_first_give_the_same_grey(usual):
    coloured = np.stack([usual[1], usual[1] // 2, usual[1] // 3], axis=-1)
    np.testing.assert_array_equal(grey_picture(coloured), grey_picture(coloured[..., ::-1]))


@pytest.mark.parametrize("kind", [np.uint16, np.float32, np.float64])
def test_other_numbers_than_8_bits_are_stretched(usual, kind):
    """A dim 12-bit picture, of which 8 bits would have kept ten levels."""
    found = detect_points((usual[0] * 10.0 + 100.0).astype(kind), TARGET)
    assert np.mean(found.status == "ok") > 0.9


@pytest.mark.parametrize(
    "image",
    [
        np.zeros((40, 40, 2), np.uint8),
        np.zeros((40, 40), np.int64),
        np.zeros((40, 40), complex),
        np.full((40, 40), np.nan),
        np.zeros((0, 40), np.float32),
        np.zeros((0, 40), np.uint8),
        np.zeros(40, np.uint8),
    ],
    ids=["two channels", "64 bits", "complex", "not a number", "empty", "empty grey", "a line"],
)
def test_an_image_of_another_kind_is_refused(image):
    with pytest.raises(ValueError, match=r"give \(height, width\) or \(height, width, 1, 3 or 4\)"):
        detect_points(image, TARGET)


def test_16_bits_in_the_other_byte_order_are_the_same_picture(usual):
    """As they come from a file that holds the higher byte first."""
    image = usual[1].astype(np.uint16) * 13
    np.testing.assert_array_equal(grey_picture(image.astype(">u2")), grey_picture(image.astype("<u2")))


@pytest.mark.parametrize("kind", [np.uint16, np.float32])
def test_single_pixels_far_beyond_the_others_leave_the_grey_levels_to_these(usual, kind):
    """A picture of 10 bits with white and black pixels of 16: stretched to these it would have four grey levels."""
    image = 20000.0 + 4.0 * usual[0]
    spoiled = image.copy()
    spoiled[[50, 200, 300], [60, 300, 100]], spoiled[[10, 250], [20, 200]] = 65535.0, 0.0
    before, after = grey_picture(image.astype(kind)), grey_picture(spoiled.astype(kind))
    # The medians of 3 x 3 pixels of a board reach within a few levels of its extremes.
    assert np.median(np.abs(after.astype(int) - before)) <= 3
    assert set(after[[50, 200, 300], [60, 300, 100]]) == {255}
    assert set(after[[10, 250], [20, 200]]) == {0}


@pytest.mark.parametrize("target", [TARGET, PlainChessboard(), Charuco(), AprilGrid(), CircleGrid()])
@pytest.mark.parametrize("shape", [(1, 1), (1, 3000), (3000, 2), (3, 200), (30, 30), (200, 3)])
def test_a_picture_too_small_for_a_board_has_none(shape, target):
    assert set(detect_points(np.zeros(shape, np.uint8), target).status) == {"board_not_found"}


@pytest.mark.parametrize("circle", [(1, 2), None])
def test_a_negative_is_no_picture_of_the_board(circle):
    """With black and white exchanged it looks like the board after half a turn, but for its margin and its circle."""
    image = 220 - Drawing(**BASE, circle=circle).image()
    assert set(detect_points(image, TARGET).status) == {"other_board"}


def test_a_negative_without_its_margin_is_told_by_its_circle():
    image = 220 - Drawing(**BASE, margin=0.0).image()
    assert set(detect_points(image, TARGET).status) == {"other_board"}


KINDS = {
    "low contrast": lambda: Drawing(white=60.0, black=54.0, **BASE).image(),
    "overexposed": lambda: Drawing(white=600.0, black=90.0, **BASE).image(),
    "strong blur": lambda: Drawing(blur_px=4.0, **BASE).image(),
    "very sharp": lambda: Drawing(blur_px=0.2, **BASE).image(),
    "much noise": lambda: Drawing(noise=15.0, **BASE).image(),
    "compressed": lambda: jpeg(Drawing(**BASE).image(), 20),
    "sharpened": lambda: jpeg(sharpened(Drawing(**BASE).image()), 80),
    "strong tilt": lambda: Drawing(**BASE | {"angles_deg": (68.0, 0.0, 20.0), "distance": 8.0}).image(),
}


@pytest.mark.parametrize("kind", KINDS)
def test_the_board_is_found_and_its_corners_are_numbered(kind):
    tilted = kind == "strong tilt"
    drawing = Drawing(**BASE | ({"angles_deg": (68.0, 0.0, 20.0), "distance": 8.0} if tilted else {}))
    seen = find_board(KINDS[kind](), TARGET)
    assert not isinstance(seen, PointStatus), seen
    assert len(seen.ids) == 54
    # Good to a pixel, two where a blur of 4 px hides the corners; another corner is more than five away.
    assert np.linalg.norm(seen.points_px - drawing.truth()[seen.ids], axis=1).max() < 2.5


def test_an_uneven_light_leaves_the_board():
    """From a tenth of the light to all of it, which no single threshold divides."""
    drawing = Drawing(**BASE)
    light = np.linspace(0.1, 1.2, drawing.width)
    image = np.clip(drawing.linear() * light + 1.0, 0, 255).astype(np.uint8)
    seen = find_board(image, TARGET)
    assert len(seen.ids) == 54


def test_a_small_board_in_a_large_picture_is_found():
    """Its squares vanish in the reduced picture that is looked at first."""
    small = Drawing(**BASE | {"distance": 18.0}).image()
    image = np.full((3000, 4000), 90, np.uint8)
    image[2000 : 2000 + small.shape[0], 3000 : 3000 + small.shape[1]] = small
    seen = find_board(image, TARGET)
    truth = Drawing(**BASE | {"distance": 18.0}).truth()[:-1] + [3000.0, 2000.0]
    assert len(seen.ids) == 54
    assert np.linalg.norm(seen.points_px - truth, axis=1).max() < 1.5
