"""The corners of a board together: what their stated covariances hold."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from pipelines.detection.board_map import BoardMap
from pipelines.detection.corner_blur import measured_blur
from pipelines.detection.corner_sites import chessboard_sites
from pipelines.detection.corners import refine_corners
from tests.pipelines.detection.test_finders import CORNERS, TARGET, drawn, pixels_of


@pytest.fixture(scope="module")
def clean():
    """A picture with little noise, and where its corners are."""
    return drawn(30.0, 20.0, cells=6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_corner_states_a_third_of_its_own_noise_and_two_thirds_of_the_boards(clean, seed):
    """Where noise is twice as large, its variance is four times: 4 / 3 + 2 / 3 = 2 times the others' is stated."""
    image, truth = clean
    noise, loud = np.random.default_rng(seed).standard_normal(image.shape), [11, 14, 17, 31, 34, 37, 49, 52]
    y, x = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
    around = np.any([np.hypot(x - p, y - q) < 14.0 for p, q in truth[loud]], axis=0)  # a fit's window is 10 px
    board = BoardMap.fit(CORNERS, truth, image.shape[::-1], np.ones(54))
    stated = []
    for amount in (np.full(image.shape, 4.0), np.where(around, 8.0, 4.0)):
        grey = np.clip(np.rint(image + amount * noise), 0, 255).astype(np.uint8)
        corners = refine_corners(grey, board, chessboard_sites(TARGET))
        assert corners.consistent.all()
        stated.append(np.trace(corners.covariance_px2, axis1=1, axis2=2))
    ratio = stated[1] / stated[0]
    # A corner's pixels tell its noise to a tenth, eight corners to 0.035 of 4: a third of that is 0.05. The picture's
    # own noise of 1 takes another 0.06, and black is cut off at 0. Measured 1.83 to 1.88; 3.8 if only its own noise
    # were stated, 1.0 if only the board's were.
    assert np.mean(ratio[loud]) / np.mean(np.delete(ratio, loud)) == pytest.approx(2.0, abs=0.25)


@pytest.mark.parametrize("shift", [0.0, 0.3, 0.45])
def test_edges_without_any_blur_are_placed_by_the_share_of_each_pixel(shift):
    """The picture of an ideal lens: each pixel has the mean over its area, and edges run along the pixels."""
    side, (columns, rows) = 40, (TARGET.columns, TARGET.rows)
    squares = np.add.outer(np.arange(rows), np.arange(columns)) % 2
    board = np.pad(255.0 * squares, 1, constant_values=255.0)
    sharp = np.pad(np.kron(board, np.ones((side, side))), 20, constant_values=120.0)
    image = (1.0 - shift) * sharp + shift * np.roll(sharp, 1, axis=1)
    image = (1.0 - shift) * image + shift * np.roll(image, 1, axis=0)
    truth = CORNERS * side + 20.0 + 2.0 * side - 0.5 + shift
    size = (image.shape[1], image.shape[0])
    sites = replace(chessboard_sites(TARGET), circled=None)
    first = BoardMap.fit(CORNERS, truth + np.random.default_rng(0).uniform(-0.3, 0.3, truth.shape), size, np.ones(54))
    found = refine_corners(np.rint(image).astype(np.uint8), first, sites)
    assert found.consistent.all()
    # Measured 0.0003 px, and 0.0147 where an edge lies 0.05 px from a pixel's border: the model keeps a blur of 0.06
    # px, so that its derivatives are smooth. A gaussian in the place of the pixel's area is up to 0.15 px off.
    assert np.abs(found.points_px - truth).max() < (0.02 if shift == 0.45 else 0.004)


def test_sharpened_pictures_are_not_refused():
    """Halos are not in the model, but alike along all edges: the stated error says how far corners are off."""
    image, truth = drawn(30.0, 20.0, cells=6)
    grey = image.astype(np.float64)
    sharpened = np.clip(np.rint(grey + 1.5 * (grey - gaussian_filter(grey, 1.2))), 0, 255).astype(np.uint8)
    board = BoardMap.fit(CORNERS, truth, image.shape[::-1], np.ones(54))
    found = refine_corners(sharpened, board, chessboard_sites(TARGET))
    assert found.consistent.all()
    error = found.points_px - truth
    assert np.sqrt(np.mean(error**2)) < 0.02
    normalised = np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.covariance_px2), error) / 2.0
    # 108 numbers tell their mean square to 0.14. Measured 0.90.
    assert 0.6 < normalised.mean() < 1.5


@pytest.mark.parametrize("blur", [0.8, 2.0, 4.0])
def test_the_blur_is_read_off_the_picture(blur):
    truth = pixels_of(CORNERS, 30.0, 20.0, 0.02, (210.0, 200.0))
    image, _ = drawn(30.0, 20.0)
    image = np.rint(gaussian_filter(image.astype(np.float64), np.sqrt(max(blur**2 - 0.57, 0.0)))).astype(np.uint8)
    first = BoardMap.fit(CORNERS, truth + 0.4, image.shape[::-1], np.ones(54))
    # The drawing's own blur is 0.76 px. A third is near enough to start from.
    assert measured_blur(image, first, chessboard_sites(TARGET)) == pytest.approx(max(blur, 0.76), rel=0.34)
