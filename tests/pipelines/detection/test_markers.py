"""Markers in pictures that are full of pieces like them: the work stays bounded, and a board among them is read."""

import cv2
import numpy as np
import pytest

from pipelines.detection import markers
from pipelines.detection.markers import find_aprilgrid, find_charuco, is_crowded
from render.targets.aprilgrid import AprilGrid
from render.targets.charuco import Charuco

CHARUCO, TAGS = Charuco(columns=6, rows=5), AprilGrid(columns=4, rows=3)


def charuco(scale=40):
    """Picture of the board, its squares `scale` px, and where its inner corners are."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    board = cv2.aruco.CharucoBoard((CHARUCO.columns, CHARUCO.rows), 100.0, CHARUCO.marker_mm, dictionary)
    y, x = np.mgrid[1 : CHARUCO.rows, 1 : CHARUCO.columns] * scale - 0.5
    return board.generateImage((CHARUCO.columns * scale, CHARUCO.rows * scale)), np.stack((x, y), -1).reshape(-1, 2)


def tags(module=5):
    """Picture of the tags, and where their corners are."""
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
    side = 10 * module
    gap = round(TAGS.spacing * side)
    rows, columns = TAGS.rows, TAGS.columns
    drawn = np.full((rows * (side + gap) + gap, columns * (side + gap) + gap), 255, np.uint8)
    corners = np.empty((4 * rows * columns, 2))
    for number in range(rows * columns):
        row, column = divmod(number, columns)
        x, y = gap + column * (side + gap), gap + (rows - 1 - row) * (side + gap)
        drawn[y : y + side, x : x + side] = dictionary.generateImageMarker(number, side, borderBits=2)[::-1, ::-1]
        for corner, (u, v) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
            corners[TAGS.corner_index(number, corner)] = x + u * side - 0.5, y + v * side - 0.5
    return drawn, corners


BOARDS = {"charuco": (charuco, find_charuco, CHARUCO), "aprilgrid": (tags, find_aprilgrid, TAGS)}


def among(drawn, at, width=1200, height=1000, step=12):
    """A picture with a board at a place, px, before a wall of small squares."""
    y, x = np.mgrid[0:height, 0:width]
    picture = np.where((x % step < step - 2) & (y % step < step - 2), 60, 220).astype(np.uint8)
    rows, columns = drawn.shape
    picture[at[1] - 20 : at[1] + rows + 20, at[0] - 20 : at[0] + columns + 20] = 255
    picture[at[1] : at[1] + rows, at[0] : at[0] + columns] = drawn
    return cv2.GaussianBlur(picture, (0, 0), 0.7)


@pytest.mark.parametrize("name", BOARDS)
def test_a_board_before_a_wall_of_squares_is_read_in_tiles(name):
    """Somewhere on the borders of tiles, too."""
    draw, find, target = BOARDS[name]
    drawn, corners = draw()
    for at in ((100, 80), (450, 400)):
        picture = among(drawn, at)
        assert is_crowded(cv2.resize(picture, None, fx=2.0, fy=2.0, interpolation=cv2.INTER_CUBIC))
        seen = find(picture, target)
        assert len(seen.ids) > 0.8 * len(corners)
        assert np.abs(seen.points_px - corners[seen.ids] - at).max() < 1.5


@pytest.mark.parametrize("name", BOARDS)
def test_tiles_give_the_same_numbers_and_places_as_the_whole(name, monkeypatch):
    draw, find, target = BOARDS[name]
    drawn, _ = draw()
    picture = cv2.copyMakeBorder(drawn, 90, 120, 70, 150, cv2.BORDER_CONSTANT, value=255)
    whole = find(picture, target)
    monkeypatch.setattr(markers, "MOST_PIECES", 0)
    tiles = find(picture, target)
    order = np.argsort(whole.ids), np.argsort(tiles.ids)
    np.testing.assert_array_equal(whole.ids[order[0]], tiles.ids[order[1]])
    assert np.abs(whole.points_px[order[0]] - tiles.points_px[order[1]]).max() < 1.0  # whole pixels of an enlarged one


def test_pieces_are_compared_with_the_board_s_own_markers_only():
    """OpenCV compares each piece with each marker: all 587 tags take 16 times as long as 36."""
    assert len(markers._own_markers("DICT_APRILTAG_36h11", 12).bytesList) == 12
    drawn, _ = tags()
    seen = find_aprilgrid(cv2.copyMakeBorder(drawn, 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=255), TAGS)
    smaller = find_aprilgrid(
        cv2.copyMakeBorder(drawn, 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=255), AprilGrid(columns=4, rows=2)
    )
    assert (len(seen.ids), len(smaller.ids)) == (48, 32)


def test_an_ordinary_board_is_no_crowd():
    for draw, _, _ in BOARDS.values():
        assert not is_crowded(draw()[0])
