"""Tone curves read off a board's picture, and corners in pictures that have one."""

import numpy as np
import pytest
from scipy.ndimage import grey_erosion

from pipelines.detection.board_map import BoardMap
from pipelines.detection.corner_sites import chessboard_sites
from pipelines.detection.corners import refine_corners
from pipelines.detection.tone_curve import decoded, measured_exponent
from tests.pipelines.detection.test_finders import CORNERS, TARGET, drawn

SITES = chessboard_sites(TARGET)


def measured(image, board):
    return measured_exponent(image, decoded(image, 1.0), board, SITES)


@pytest.fixture(scope="module", params=[20.0, 40.0], ids=["turned", "slanted"])
def board(request):
    """A picture in light, where its corners are, and their map."""
    image, truth = drawn(30.0, request.param, cells=6)
    return image, truth, BoardMap.fit(CORNERS, truth, image.shape[::-1], np.ones(54))


def encoded(light, exponent):
    return np.rint(255.0 * (light / 255.0) ** (1.0 / exponent)).astype(np.uint8)


def srgb(light):
    """Source: IEC 61966-2-1."""
    share = light / 255.0
    return np.rint(255.0 * np.where(share < 0.0031308, 12.92 * share, 1.055 * share ** (1 / 2.4) - 0.055))


# Measured within 0.03. An edge moves by 0.13 px for a step of 1 in the exponent, and 36 edges tell it to 0.003 px.
@pytest.mark.parametrize("exponent", [1.4, 1.8, 2.2, 2.6])
def test_the_exponent_is_read_off_the_squares(board, exponent):
    image, _, of_corners = board
    assert measured(encoded(image, exponent), of_corners) == pytest.approx(exponent, abs=0.08)


def test_srgb_is_nearly_a_power_of_2_2(board):
    image, _, of_corners = board
    assert measured(srgb(image).astype(np.uint8), of_corners) == pytest.approx(2.2, abs=0.2)


def test_light_is_left_alone(board):
    image, _, of_corners = board
    assert measured(image, of_corners) == 1.0
    np.testing.assert_array_equal(decoded(image, 1.0), image)


def test_print_that_runs_is_no_tone_curve(board):
    """Black squares larger than white ones."""
    image, _, of_corners = board
    assert measured(grey_erosion(image, (3, 3)), of_corners) == 1.0


def test_a_board_without_contrast_has_no_tone_curve(board):
    image, _, of_corners = board
    flat = np.random.default_rng(0).integers(90, 110, image.shape).astype(np.uint8)
    assert measured(flat, of_corners) == 1.0


def test_corners_of_an_encoded_picture_are_as_good_as_those_in_light(board):
    image, truth, of_corners = board
    for grey in (image, encoded(image, 2.2)):
        found = refine_corners(grey, of_corners, SITES)
        assert found.consistent.all()
        errors = found.points_px - truth
        whitened = np.linalg.cholesky(np.linalg.inv(found.covariance_px2)).transpose(0, 2, 1) @ errors[..., None]
        # 108 numbers tell an RMS to 7 %. Taken for light, the encoded picture has 0.4, and loses corners.
        assert 0.75 < np.sqrt(np.mean(whitened**2)) < 1.25
