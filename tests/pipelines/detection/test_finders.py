"""Finding the board without a hint: at any angle, in its own order, and not where it is not."""

import cv2
import numpy as np
import pytest

from pipelines.detection import Detector, detect_points, lattice_finder
from pipelines.detection.board_map import grid
from pipelines.detection.finders import find_board, find_sector_based
from pipelines.detection.statuses import PointStatus
from pipelines.detection.textured_region import textured_region
from render.targets.chessboard import Chessboard
from tests.supersampled import digitised, picture

TARGET = Chessboard()
CORNERS = grid(TARGET.inner)
MIDDLE = np.array([4.0, 2.5])
WHITE, BLACK, BEHIND = 200.0, 20.0, 90.0
WIDTH, HEIGHT = 420, 400
CELLS = 3  # to a pixel: finders are good to half a pixel at best


def pixels_of(at, square_px, angle_deg, tilt, middle):
    """(n, 2) px of points on a board that is turned in the picture and then tilted about its vertical."""
    angle = np.deg2rad(angle_deg)
    x, y = ((at - MIDDLE) @ np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])).T
    depth = 1.0 + tilt * x
    return square_px * np.stack((x / depth, y / depth), axis=1) + middle


def drawn(square_px, angle_deg, tilt=0.02, middle=(210.0, 200.0), width=WIDTH, height=HEIGHT, cells=CELLS):
    """Picture of the board, and where its corners are."""
    truth = pixels_of(CORNERS, square_px, angle_deg, tilt, middle)
    plane = np.array([[-2.0, -2.0], [10.0, -2.0], [10.0, 7.0], [-2.0, 7.0]])  # the board with its margin
    outline = pixels_of(plane, square_px, angle_deg, tilt, middle)
    back = cv2.getPerspectiveTransform(outline.astype(np.float32), plane.astype(np.float32))

    def grey(x, y):
        u, v = cv2.perspectiveTransform(np.stack((x.ravel(), y.ravel()), axis=-1)[None], back)[0].T.reshape(2, *x.shape)
        squares = (u > -1) & (u < 9) & (v > -1) & (v < 6)
        black = squares & ((np.floor(u) + np.floor(v)) % 2 == 0)
        black |= (u + 0.5) ** 2 + (v - 0.5) ** 2 < 0.3**2  # the circle
        board = (u > -2) & (u < 10) & (v > -2) & (v < 7)
        return np.where(black, BLACK, np.where(board, WHITE, BEHIND))

    return digitised(picture(grey, width, height, 0.7, cells), np.random.default_rng(0), 1.0), truth


def worst(found, truth):
    return np.linalg.norm(found.points_px - truth, axis=1).max()


@pytest.mark.parametrize("angle", range(0, 360, 15))
def test_the_order_is_the_boards_own_at_any_angle(angle):
    """The first corner is the one at the black square, x runs along the columns, however the board is turned."""
    image, truth = drawn(26.0, angle)
    found = find_board(image, TARGET)
    # A wrong order is off by 26 px at least; before refinement a corner is good to a pixel.
    assert found is not None
    assert worst(found, truth) < 1.5


@pytest.mark.parametrize("angle", [0, 100, 180, 250])
def test_the_sector_based_finder_alone_orders_likewise(angle):
    image, truth = drawn(26.0, angle)
    found = find_sector_based(image, TARGET)
    assert found.finder == "sector"
    assert worst(found, truth) < 1.0


@pytest.mark.parametrize(("square_px", "width", "height"), [(5.0, 90, 80), (60.0, 960, 900)])
def test_a_place_found_is_not_off_on_the_whole(square_px, width, height):
    """Levels are enlarged and reduced: pixel centres taken for corners would be off by half a pixel of the level."""
    image, truth = drawn(square_px, 20, middle=(0.5 * width, 0.5 * height), width=width, height=height, cells=2)
    found = find_board(image, TARGET)
    assert len(found.ids) == len(truth)
    assert np.abs(np.mean(found.points_px - truth, axis=0)).max() < 0.15


def test_small_squares_are_found_enlarged():
    """Four pixels to a square."""
    image, truth = drawn(4.0, 15, middle=(120.0, 260.0))
    found = find_board(image, TARGET)
    # A wrong order would be off by 4.
    assert len(found.ids) == len(truth)
    assert worst(found, truth) < 1.5


def test_the_textured_region_holds_the_board_and_little_else():
    image = np.full((600, 800), 90, np.uint8)
    image[200:300, 500:650] = 200
    x, y, width, height = textured_region(image)
    # A margin of 16 px, on a grid of 4 px whose gradient reaches one further on each side.
    assert 500 - 24 <= x <= 500 - 16
    assert 200 - 24 <= y <= 200 - 16
    assert 650 + 16 <= x + width <= 650 + 24
    assert 300 + 16 <= y + height <= 300 + 24


def test_the_textured_region_stays_in_the_picture():
    image = np.full((100, 130), 90, np.uint8)
    image[:, ::8] = 200
    assert textured_region(image) == (0, 0, 130, 100)
    assert textured_region(np.full((100, 130), 90, np.uint8)) == (0, 0, 130, 100)


def test_faint_texture_beside_the_board_is_left_out():
    """A third of the strongest edge is texture; a wall's grain of 20 grey values is not."""
    image, truth = drawn(20.0, 0, width=800)
    image[:, 600:] += np.random.default_rng(0).integers(0, 20, (HEIGHT, 200), dtype=np.uint8)
    x, _, width, _ = textured_region(image)
    assert x < truth[:, 0].min()
    assert truth[:, 0].max() < x + width < 600


def wrong_picture(kind):
    rng, (image, _) = np.random.default_rng(0), drawn(26.0, 10)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    if kind == "black":
        return np.zeros_like(image)
    if kind == "noise":
        return rng.integers(0, 256, (HEIGHT, WIDTH)).astype(np.uint8)
    if kind == "checks without margin":
        return (((x // 20 + y // 20) % 2) * 255).astype(np.uint8)
    column, row = (x - 75) // 50, (y - 75) // 50  # another board: five squares by five
    inside = (column >= 0) & (column < 5) & (row >= 0) & (row < 5)
    return np.where(inside & ((column + row) % 2 == 0), 10, 200).astype(np.uint8)


WRONG = {
    "black": PointStatus.BOARD_NOT_FOUND,
    "noise": PointStatus.BOARD_NOT_FOUND,
    "checks without margin": PointStatus.OTHER_BOARD,
    "another board": PointStatus.OTHER_BOARD,
}


@pytest.mark.parametrize("detector", [Detector.EDGE_FIT, Detector.OPENCV_SB])
@pytest.mark.parametrize("kind", WRONG)
def test_what_is_not_the_board_gives_a_status(kind, detector):
    found = detect_points(wrong_picture(kind), TARGET, detector)
    assert set(found.status) == {WRONG[kind]}
    assert np.isnan(found.points_px).all()
    assert np.isnan(found.covariance_px2).all()


def test_the_squares_of_a_lattice_larger_than_the_board_are_not_looked_at(monkeypatch):
    """Those of a texture are thousands, and each is compared with each: 8 s and 2.3 GB over 24 megapixels."""

    def look(*_):
        raise AssertionError("looked at")

    monkeypatch.setattr(lattice_finder, "look_at_squares", look)
    y, x = np.mgrid[0:400, 0:500] // 20
    checkers = cv2.GaussianBlur(np.where((x + y) % 2, 40, 200).astype(np.uint8), (0, 0), 0.8)
    assert find_board(checkers, TARGET) == PointStatus.OTHER_BOARD
    with pytest.raises(AssertionError):
        find_board(drawn(30.0, 10.0)[0], TARGET)


def test_a_large_picture_of_noise_comes_to_an_end():
    """OpenCV's finders would take minutes; no time is asserted, it depends on the machine."""
    noise = np.random.default_rng(1).integers(0, 256, (2000, 3000)).astype(np.uint8)
    assert find_sector_based(noise, TARGET) == PointStatus.BOARD_NOT_FOUND
    assert set(detect_points(noise, TARGET).status) == {"board_not_found"}
