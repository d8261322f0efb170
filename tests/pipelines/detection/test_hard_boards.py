"""Boards that tell little: of a few pixels a square, of nine corners, half in shadow, without a margin in clutter."""

import numpy as np
import pytest

from pipelines.detection import detect_points
from render.targets.chessboard import Chessboard
from render.targets.plain_chessboard import PlainChessboard
from tests.drawn_boards import Drawing
from tests.supersampled import digitised, picture

TARGET = Chessboard()
SMALL = {"width": 200, "height": 160, "focal_px": 260.0, "circle": None, "angles_deg": (10.0, -8.0, 10.0)}


def normalised(found, truth, chosen):
    error = found.points_px[chosen] - truth[chosen]
    return np.einsum("ni,nij,nj->n", error, np.linalg.inv(found.covariance_px2[chosen]), error) / 2.0


@pytest.mark.parametrize("side_px", [4.0, 4.5])
def test_corners_of_squares_of_four_pixels_are_found(side_px):
    drawing = Drawing(distance=260.0 / side_px, cells=6, **SMALL)
    found = detect_points(drawing.image(), PlainChessboard(margin_mm=100.0))
    ok = found.status == "ok"
    assert np.mean(ok) > 0.9
    # 108 coordinates tell their scatter to 7 %. Noise of half a level moves such a corner by 0.005 px.
    assert np.sqrt(np.mean(normalised(found, drawing.truth(), ok))) < 1.3
    assert np.linalg.norm(found.points_px[ok] - drawing.truth()[ok], axis=1).max() < 0.05


@pytest.mark.full
def test_nine_corners_state_their_errors():
    """Their map has 13 numbers for 18 coordinates, and tells little of how the outermost edges bend."""
    rng, squares = np.random.default_rng(5), []
    target = PlainChessboard(columns=4, rows=4, margin_mm=100.0)
    for _ in range(12):
        drawing = Drawing(
            columns=4,
            rows=4,
            circle=None,
            width=300,
            height=280,
            focal_px=140.0,
            distance=rng.uniform(3.6, 4.4),
            angles_deg=tuple(rng.uniform([-30, -30, -180], [30, 30, 180])),
            cells=6,
        )
        found = detect_points(digitised(drawing.linear(), rng, 1.0), target)
        # Which way a board of 4 x 4 squares lies nothing tells: each corner is compared with the truth nearest to it.
        truth = drawing.truth()
        nearest = np.argmin(np.linalg.norm(found.points_px[:, None] - truth, axis=2), axis=1)
        squares.append(normalised(found, truth[nearest], np.ones(9, bool)))
    # 216 coordinates tell the root mean square to 5 %.
    assert 0.8 < np.sqrt(np.mean(squares)) < 1.3


@pytest.mark.parametrize("share", [0.45, 0.7])
def test_a_board_of_which_a_part_lies_in_a_hard_shadow_is_found(share):
    drawing = Drawing()
    light = np.where(np.arange(drawing.width) < share * drawing.width, 0.3, 1.0)
    image = np.clip(np.rint(drawing.linear() * light), 0, 255).astype(np.uint8)
    found, truth = detect_points(image, TARGET), drawing.truth()
    ok = found.status == "ok"
    on_edge = np.abs(truth[:, 0] - share * drawing.width) < 6.0
    assert np.all(ok[:-1][~on_edge[:-1]])
    assert np.linalg.norm(found.points_px[ok] - truth[ok], axis=1).max() < 0.1


@pytest.mark.full
@pytest.mark.parametrize("seed", range(2))
def test_a_board_without_a_margin_is_found_before_clutter(seed):
    rng = np.random.default_rng(seed)
    drawing = Drawing(
        margin=0.0,
        circle=None,
        width=400,
        height=300,
        focal_px=190.0,
        angles_deg=(15.0, -10.0, rng.uniform(-60.0, 60.0)),
    )
    places, sizes = rng.uniform(0.0, [[400.0], [300.0]], (2, 150)), rng.uniform(4.0, 16.0, (2, 150))
    levels = rng.uniform(20.0, 200.0, 150)

    def grey(x, y):
        board, out = drawing.grey(x, y), np.full(x.shape, 90.0)
        for (px, py), (w, h), level in zip(places.T, sizes.T, levels, strict=True):
            out = np.where((abs(x - px) < w) & (abs(y - py) < h), level, out)
        return np.where(board == 90.0, out, board)  # 90 is what is not the board

    image = digitised(picture(grey, 400, 300, 0.7, 4), rng, 1.0)
    found = detect_points(image, PlainChessboard(margin_mm=0.0))
    truth = drawing.truth()
    assert set(found.status) <= {"ok", "orientation_ambiguous"}
    nearest = np.linalg.norm(found.points_px[:, None] - truth, axis=2).min(axis=1)
    assert nearest.max() < 0.1
