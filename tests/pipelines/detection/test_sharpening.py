"""Sharpened pictures: what was added to them, read off a board's edges, and corners and circle without it."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from pipelines.detection import PointStatus, detect_points
from pipelines.detection.board_map import BoardMap
from pipelines.detection.corner_sites import chessboard_sites
from pipelines.detection.encoding import PLAIN, measured_encoding
from pipelines.detection.sharpening import Sharpening, measured_sharpening, without_sharpening
from pipelines.detection.tone_curve import decoded
from tests.pipelines.detection.test_finders import CORNERS, TARGET, drawn
from tests.pipelines.detection.test_tone_curve import encoded

SITES = chessboard_sites(TARGET)
BLUR_PX = 0.8  # of `drawn`


def sharpened(image, amount, px):
    grey = np.asarray(image, float)
    return np.clip(grey + amount * (grey - gaussian_filter(grey, px)), 0.0, 255.0)


@pytest.fixture(scope="module")
def board():
    """A picture whose black and white leave room for what goes beyond them, where its corners are, and their map."""
    image, truth = drawn(30.0, 20.0, cells=6)
    return 50.0 + 0.6 * image, truth, BoardMap.fit(CORNERS, truth, image.shape[::-1], np.ones(54))


# A filter of another width and amount may act alike: what counts is that the picture comes back. An edge of 150 grey
# levels that is sharpened by 0.5 or more differs by 15 and more; the profiles' samples tell the filter to a tenth.
@pytest.mark.parametrize(("amount", "px"), [(0.6, 1.5), (1.0, 1.0), (1.5, 1.0), (2.0, 0.8)])
def test_what_was_added_is_taken_back(board, amount, px):
    image, _, of_corners = board
    picture = sharpened(image, amount, px).astype(np.float32)
    found = measured_sharpening(picture, of_corners, SITES, 0.5)
    back = without_sharpening(picture, found, of_corners(SITES.at))
    inside = np.zeros(image.shape, bool)
    low, high = of_corners(SITES.at).min(axis=0).astype(int), of_corners(SITES.at).max(axis=0).astype(int)
    inside[low[1] : high[1], low[0] : high[0]] = True
    before, after = (np.sqrt(np.mean((part - image)[inside] ** 2)) for part in (picture, back))
    assert after < 0.2 * before


def test_the_filter_that_is_known_is_taken_back_to_rounding(board):
    """Its tails that are cut off hold 1e-4 of 255 grey levels."""
    image, _, of_corners = board
    picture = sharpened(image, 1.5, 1.0).astype(np.float32)
    back = without_sharpening(picture, Sharpening(1.5, 1.0), of_corners(SITES.at))
    x, y = of_corners(np.array([[4.0, 3.0]]))[0].astype(int)
    assert np.abs(back - image)[y - 60 : y + 60, x - 60 : x + 60].max() < 0.03


@pytest.mark.parametrize("blur_px", [0.0, 1.0, 3.0])
def test_a_blur_is_none(board, blur_px):
    image, _, of_corners = board
    picture = gaussian_filter(image, blur_px).astype(np.float32) if blur_px else image.astype(np.float32)
    assert measured_sharpening(picture, of_corners, SITES, float(np.hypot(BLUR_PX, blur_px))) is None


def test_noise_and_rounding_are_none(board):
    image, _, of_corners = board
    picture = np.rint(image + np.random.default_rng(3).normal(0.0, 8.0, image.shape)).astype(np.float32)
    assert measured_sharpening(picture, of_corners, SITES, BLUR_PX) is None
    grey = np.rint(image).astype(np.uint8)
    assert measured_encoding(grey, decoded(grey, 1.0), of_corners, SITES, BLUR_PX)[0] == PLAIN


def test_a_tone_curve_is_seen_through_a_sharpening(board):
    """Undone first, as it came last. The exponent alone is told to 0.03; what is left of the filter adds to that."""
    image, _, of_corners = board
    picture = sharpened(encoded(image, 2.2), 1.0, 1.0)
    grey = np.rint(picture).astype(np.uint8)
    found, light = measured_encoding(grey, decoded(grey, 1.0), of_corners, SITES, 0.5)
    np.testing.assert_array_equal(light, found.light(grey, of_corners(SITES.at)))
    assert found.exponent == pytest.approx(2.2, abs=0.3)
    assert found.sharpening is not None


def test_corners_of_a_sharpened_picture_are_as_good_as_of_one_that_is_not(board):
    image, truth, _ = board
    noisy = image + np.random.default_rng(5).normal(0.0, 1.0, image.shape)
    errors, stated = [], []
    for picture in (noisy, sharpened(noisy, 2.0, 0.8)):
        found = detect_points(np.rint(picture).astype(np.uint8), TARGET)
        good = found.status[:54] == PointStatus.OK
        assert good.all()
        errors.append(np.sqrt(np.mean((found.points_px[:54] - truth) ** 2)))
        stated.append(np.sqrt(np.mean(found.covariance_px2[:54, [0, 1], [0, 1]])))
    # The noise is the same, so that its share cancels; measured 0.95 to 1.02, and 1.4 in the sharpened picture itself.
    assert errors[1] < 1.15 * errors[0]
    # 108 coordinates tell an RMS to 7 %.
    assert 0.7 < errors[1] / stated[1] < 1.4


def test_clipped_pixels_stay_clipped_for_the_circle(board):
    """What halos lack that were cut off comes back with no filter: read as light, they moved circles by 0.2 px."""
    image, _, of_corners = board
    grey = np.rint(sharpened(1.4 * image, 1.5, 1.0)).astype(np.uint8)
    found, light = measured_encoding(grey, decoded(grey, 1.0), of_corners, SITES, 0.5)
    clipped = grey == 255
    assert found.sharpening is not None
    assert np.mean(light[clipped] < 254.5) > 0.1
    marked = found.with_clipped(light, grey)
    assert np.all(marked[clipped] == 255.0)
    np.testing.assert_array_equal(marked[~clipped], light[~clipped])
    assert PLAIN.with_clipped(light, grey) is light


def test_a_board_that_no_camera_can_see_changes_nothing(board):
    image = board[0].astype(np.float32)
    for around in (np.full((4, 2), np.nan), np.full((4, 2), 1e6)):
        np.testing.assert_array_equal(without_sharpening(image, Sharpening(1.0, 1.0), around), image)
