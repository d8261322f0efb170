"""Finding the board without a hint: at any angle, by every finder, in its own order, and not where it is not."""

import cv2
import numpy as np
import pytest

from pipelines.detection import Detector, detect_points
from pipelines.detection.board_map import grid
from pipelines.detection.finders import FINDERS, find_board, find_sector_based, textured_region
from render.targets.chessboard import Chessboard
from tests.supersampled import digitised, picture

TARGET = Chessboard()
CORNERS = grid(TARGET.inner)
MIDDLE = np.array([4.0, 2.5])
WHITE, BLACK, BEHIND = 200.0, 20.0, 90.0
WIDTH, HEIGHT = 420, 400
CELLS = 3  # to a pixel: finders are good to half a pixel at best
NONE = {"board_not_found", "corners_inconsistent"}


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
    return np.linalg.norm(found.corners_px - truth, axis=1).max()


@pytest.mark.parametrize("angle", range(0, 360, 15))
def test_the_order_is_the_boards_own_at_any_angle(angle):
    """The first corner is the one at the black square, x runs along the columns, however the board is turned."""
    image, truth = drawn(26.0, angle)
    found = find_board(image, TARGET)
    # A wrong order is off by 26 px at least; before refinement a corner is good to a pixel.
    assert found is not None
    assert worst(found, truth) < 1.5


@pytest.mark.parametrize("rows", [1, -1])
@pytest.mark.parametrize("columns", [1, -1])
def test_any_order_of_a_finder_becomes_the_boards(rows, columns, monkeypatch):
    """From any corner, and turning the other way too."""
    image, truth = drawn(26.0, 30)
    given = truth.reshape(6, 9, 2)[::rows, ::columns].reshape(-1, 2)
    monkeypatch.setattr("pipelines.detection.finders.FINDERS", {"other": lambda image, inner: given})
    np.testing.assert_array_equal(find_board(image, TARGET).corners_px, truth)


@pytest.mark.parametrize("angle", [0, 100, 180, 250])
def test_the_sector_based_finder_alone_orders_likewise(angle):
    image, truth = drawn(26.0, angle)
    found = find_sector_based(image, TARGET)
    assert found.finder == "sector"
    assert worst(found, truth) < 1.0


@pytest.mark.parametrize("name", FINDERS)
def test_every_finder_sees_the_board(name, monkeypatch):
    image, truth = drawn(24.0, 20)
    monkeypatch.setattr("pipelines.detection.finders.FINDERS", {name: FINDERS[name]})
    found = find_board(image, TARGET)
    assert found.finder == name
    # Good to a pixel or so; an enlarged region whose pixel centres are taken for corners would be off by one more.
    assert worst(found, truth) < 1.5
    assert np.abs(np.mean(found.corners_px - truth, axis=0)).max() < 0.3


def test_small_squares_are_found_enlarged():
    """Four pixels to a square, where the classic finder sees nothing in the picture as it is."""
    image, truth = drawn(4.0, 15, middle=(120.0, 260.0))
    assert FINDERS["classic"](image, TARGET.inner) is None
    found = find_board(image, TARGET)
    assert found.finder == "enlarged"
    # Measured 0.8; a wrong order would be off by 4.
    assert worst(found, truth) < 1.5


def test_a_finder_that_misplaces_the_board_is_passed_over(monkeypatch):
    """Corners outside the picture cannot be put in order; the next finder has its turn."""
    image, truth = drawn(26.0, 0)
    astray = {"astray": lambda image, inner: truth + 1000.0, "classic": FINDERS["classic"]}
    monkeypatch.setattr("pipelines.detection.finders.FINDERS", astray)
    assert find_board(image, TARGET).finder == "classic"


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
    rng, (image, truth) = np.random.default_rng(0), drawn(26.0, 10)
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    if kind == "black":
        return np.zeros_like(image)
    if kind == "noise":
        return rng.integers(0, 256, (HEIGHT, WIDTH)).astype(np.uint8)
    if kind == "checks without margin":
        return (((x // 20 + y // 20) % 2) * 255).astype(np.uint8)
    if kind == "half a board":
        return np.where(x < truth[:, 0].mean(), image, 60).astype(np.uint8)
    if kind == "a corner covered":
        return np.where(np.hypot(*(np.stack((x, y), axis=-1) - truth[22]).T).T < 30.0, 200, image).astype(np.uint8)
    inside = (abs(x - 200) < 125) & (abs(y - 200) < 125)  # another board: five squares by five
    return np.where(inside & ((x // 50 + y // 50) % 2 == 0), 10, 200).astype(np.uint8)


KINDS = ("black", "noise", "checks without margin", "half a board", "a corner covered", "another board")
SHORT = ("black", "half a board", "a corner covered")  # the sector-based finder takes seconds over the others


# All detectors but the sector-based one begin with the same finders.
@pytest.mark.parametrize(
    ("kind", "detector"),
    [(kind, Detector.EDGE_FIT) for kind in KINDS] + [(kind, Detector.OPENCV_SB) for kind in KINDS if kind in SHORT],
)
def test_what_is_not_the_whole_board_gives_a_status(kind, detector):
    found = detect_points(wrong_picture(kind), TARGET, detector)
    assert set(found.status) <= NONE
    assert np.isnan(found.points_px).all()
    assert np.isnan(found.covariance_px2).all()


def test_a_large_picture_of_noise_comes_to_an_end():
    """The sector-based finder alone would take a minute; no time is asserted, it depends on the machine."""
    noise = np.random.default_rng(1).integers(0, 256, (480, 640)).astype(np.uint8)
    assert find_sector_based(noise, TARGET) is None
    assert set(detect_points(noise, TARGET).status) == {"board_not_found"}
