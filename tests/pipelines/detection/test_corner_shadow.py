"""Corners that a shadow's edge crosses, by brute force: where they are, and how well the fit says it knows."""

import numpy as np
import pytest

from pipelines.detection import corner_shadow
from pipelines.detection.board_map import BoardMap, grid
from pipelines.detection.corner_picture import BLUR, SHAPE, CornerTask
from pipelines.detection.corner_shadow import fit_shadowed, looks_shadowed
from pipelines.detection.corner_sites import chessboard_sites
from pipelines.detection.corners import PLAIN_NOISE, STOP
from render.targets.chessboard import Chessboard
from tests.drawn_boards import Drawing
from tests.supersampled import digitised, picture, side

HALF = 15  # of a tile, px
WINDOW_PX, SQUARE_PX, BLUR_PX = 10, 30.0, 0.7
MEAN, CONTRAST = 110.0, 85.0  # in the light, grey values
ANGLES = np.deg2rad((11.0, 96.0))  # directions of the edges' normals
IN_SHADOW = 0.3  # of the light
# Direction of the shadow's normal, degrees; its edge's distance from the corner, px; bend, 1/px; width, px.
SHADOWS = {
    "through the corner": (50.0, 0.3, 0.0, 0.0),
    "beside it": (140.0, 3.5, 0.0, 0.0),
    "along an edge": (12.0, 0.5, 0.0, 0.0),
    "bent": (60.0, 1.0, 0.005, 0.0),
    "soft": (60.0, -1.0, 0.0, 3.0),
}
TILES = 5  # of each


def tile(corner, shadow, cover=None):
    """Grey values around a corner, given in px from the tile's middle, in a shadow or beneath a cover of one grey."""
    turn, offset, bend, width = shadow

    def grey(x, y):
        u, v = x - HALF - corner[0], y - HALF - corner[1]
        saddle = np.prod([side(np.cos(a) * u + np.sin(a) * v) for a in ANGLES], axis=0)
        c, s = np.cos(np.deg2rad(turn)), np.sin(np.deg2rad(turn))
        away = c * u + s * v - offset - bend * (c * v - s * u) ** 2
        dark = 0.5 + 0.5 * (np.clip(2.0 * away / width, -1.0, 1.0) if width else side(away))
        lit = MEAN + CONTRAST * saddle
        return lit + dark * ((IN_SHADOW - 1.0) * lit if cover is None else cover - lit)

    return picture(grey, 2 * HALF + 1, 2 * HALF + 1, BLUR_PX)


def fitted(shadow, noise, cover=None):
    """What the fit makes of some corners, and their errors (n, 2) px.

    They lie up to 0.1 px off, as from a map through others; its blur is good to a twentieth, its angles to a hundredth.
    """
    rng = np.random.default_rng(3)
    corners = rng.uniform(-0.1, 0.1, (TILES, 2))
    tiles = [tile(corner, shadow, cover) for corner in corners]
    image = digitised(np.hstack(tiles), rng, noise).astype(np.float32)
    starts = np.stack((np.arange(TILES) * (2.0 * HALF + 1.0) + HALF, np.full(TILES, float(HALF))), axis=1)
    shapes = np.zeros((TILES, SHAPE))
    shapes[:, 2:4], shapes[:, BLUR] = ANGLES + 0.01, np.hypot(BLUR_PX, 0.29) + 0.04
    task = CornerTask(
        starts=starts,
        shapes=shapes,
        edges=np.zeros((TILES, 2, 3)),
        sharp=np.zeros(TILES, bool),
        inverses=np.repeat(np.eye(2)[None] / SQUARE_PX, TILES, axis=0),
        reaches=np.full((TILES, 2), 0.5),
        clears=np.full(TILES, np.inf),
        windows=np.full(TILES, WINDOW_PX),
        bands=np.full(TILES, np.inf),
        discs=np.empty((0, 2)),
        disc_axes=np.eye(2),
    )
    fits = fit_shadowed(image, task, STOP)
    return fits, fits.shapes[:, :2] - starts - corners


def sure(fits):
    """(n,) which corners the detection takes; noise of 1 and rounding have a variance of 1.08."""
    return fits.converged & (fits.noises <= PLAIN_NOISE * 1.08)


@pytest.mark.parametrize("name", SHADOWS)
def test_a_corner_upon_a_shadows_edge_is_where_the_fit_says(name):
    fits, errors = fitted(SHADOWS[name], noise=1.0)
    good = sure(fits)
    assert np.sum(good) >= TILES - 1  # one start in twenty leads away, and is known by its noise
    inverse = np.linalg.inv((fits.covariances * fits.noises[:, None, None])[good])
    scaled = np.einsum("ni,nij,nj->n", errors[good], inverse, errors[good])
    assert np.sum(scaled) < 29.6  # of ten squares of normal errors one in a thousand is more
    assert np.sum(scaled) > 0.8  # of eight, one in a thousand is less: nor is too much stated


@pytest.mark.parametrize("grey", [40.0, 110.0, 180.0])
def test_what_covers_a_corner_is_no_shadow(grey):
    for shadow in ("through the corner", "beside it"):
        assert not np.any(fitted(SHADOWS[shadow], noise=1.0, cover=grey)[0].converged)


def test_no_more_corners_are_tried_than_there_is_time_for(monkeypatch):
    monkeypatch.setattr(corner_shadow, "MOST_TRIED", 2)
    assert np.sum(fitted(SHADOWS["through the corner"], noise=1.0)[0].converged) == 2


def test_clipped_pixels_are_glare_and_no_shadow(monkeypatch):
    monkeypatch.setattr(corner_shadow, "WHITEST", MEAN + 0.5 * CONTRAST)
    assert not np.any(fitted(SHADOWS["through the corner"], noise=1.0)[0].converged)


def test_a_corner_looks_shadowed_beside_lit_and_shaded_white_only():
    drawing = Drawing(width=520, height=400, focal_px=260.0, angles_deg=(20.0, -15.0, 10.0))
    target, corners = Chessboard(), drawing.truth()[:-1]
    image = np.float32(drawing.linear())
    board = BoardMap.fit(grid(target.inner), corners, image.shape[::-1], np.ones(len(corners)))
    sites, contrast = chessboard_sites(target), np.ptp(image)
    apart = np.linalg.norm(corners - drawing.truth()[-1], axis=1) > 30.0  # px, from the circle, which is dark on white
    assert not np.any(looks_shadowed(image, board, sites, contrast)[apart])
    edge = round(np.sort(corners[:, 0])[len(corners) // 2])  # through one of them
    image[:, edge:] *= IN_SHADOW
    away = np.abs(corners[:, 0] - edge)  # px; squares are some 20 px wide
    found = looks_shadowed(image, board, sites, contrast)
    assert np.all(found[away < 2.0])
    assert np.sum(away < 2.0) > 0
    assert not np.any(found[(away > 20.0) & apart])
