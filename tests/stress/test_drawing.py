"""The drawing against what can be computed by hand, and its truth against OpenCV's own corner finder."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from tests.stress.boards import BLACK, WHITE, Board
from tests.stress.drawing import Spread, draw
from tests.stress.kinds import KINDS
from tests.stress.lenses import Lens
from tests.stress.scenes import Scene
from tests.stress.views import LENSES, Framing

SMALL = Framing(width=400, height=300, least=0.9)
STOP = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-4)
DIRECTIONS = np.array([[0.1, 0.2, 1.0], [-0.7, 0.3, 1.0], [0.4, -0.9, 0.8], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("kind", LENSES)
@pytest.mark.parametrize("sway", [0.0, 1.5])
def test_pixels_and_rays_agree(kind, sway):
    lens = Lens(kind, 300.0, 280.0, 319.0, 241.0, LENSES[kind][1], skew=0.02 * sway, sway=sway)
    unit = DIRECTIONS / np.linalg.norm(DIRECTIONS, axis=1)[:, None]
    np.testing.assert_allclose(lens.rays(*lens.project(DIRECTIONS).T), unit, atol=1e-12)


def test_equidistance_is_its_formula():
    """45 degrees off the axis: r = f pi / 4."""
    at = Lens("equidistance", 300.0, 300.0, 0.0, 0.0).project(np.array([[1.0, 0.0, 1.0]]))
    np.testing.assert_allclose(at, [[300.0 * np.pi / 4.0, 0.0]], atol=1e-12)


def test_a_pixel_has_the_area_that_black_covers():
    """A board that faces a pinhole camera, one px for 5 mm: the edge at x = 0 lies 0.3 px into its pixel."""
    lens = Lens("pinhole", 200.0, 200.0, 30.0 - 0.2, 20.0)
    scene = Scene(Board(disc=False), lens, np.eye(3), np.array([0.0, 0.0, 1000.0]))
    picture = draw(scene, 64, 48, finer=4)
    # Column 30 spans 29.5 to 30.5, the edge stands at 29.8. Row 10 lies in the first row of squares, black at x < 0.
    np.testing.assert_allclose(picture[10, 28:33], [BLACK, BLACK, 0.3 * BLACK + 0.7 * WHITE, WHITE, WHITE], atol=1e-6)
    np.testing.assert_allclose(picture[10:30, 30].mean(), picture[10:30, 28:33].mean(), atol=0.06)


def test_point_spread_keeps_the_light_in_its_place():
    lens = Lens("pinhole", 200.0, 200.0, 40.0, 30.0)
    scene = Scene(Board(columns=4, rows=4, square=20.0, disc=False), lens, np.eye(3), np.array([-20.0, -20.0, 1000.0]))
    sharp = draw(scene, 81, 61)
    y, x = np.indices(sharp.shape)
    for spread in (Spread(gaussian=1.0), Spread(disc=2.0), Spread(streak=5.0)):
        soft = draw(scene, 81, 61, spread)
        excess = soft - soft[0, 0]
        before = sharp - sharp[0, 0]
        np.testing.assert_allclose(excess.sum(), before.sum(), rtol=1e-4)
        for place in (x, y):
            centre = (excess * place).sum() / excess.sum()
            np.testing.assert_allclose(centre, (before * place).sum() / before.sum(), atol=1e-3)


@pytest.mark.parametrize("changes", [{}, {"curvature": 3e-4}, {"mirrored": True}, {"stretch": 1.05}])
def test_truth_lies_where_opencv_places_corners(changes):
    """OpenCV knows nothing of us: half of its corners lie within 0.03 px of the truth, without a common shift."""
    kind = KINDS["clean"]
    shot = replace(kind, framing=SMALL, finer=2, board=replace(kind.board, disc=False, **changes)).shot(1)
    truth = shot.truth[:-1]
    placed = cv2.cornerSubPix(shot.image, truth.astype(np.float32)[:, None].copy(), (5, 5), (-1, -1), STOP)[:, 0]
    error = placed - truth
    assert np.median(np.abs(error)) < 0.03
    np.testing.assert_allclose(np.median(error, axis=0), 0.0, atol=0.01)


def test_a_picture_is_the_same_in_every_run():
    kind = replace(KINDS["plain-noise"], framing=SMALL, finer=2)
    np.testing.assert_array_equal(kind.shot(3).image, kind.shot(3).image)
