"""Noise that neighbouring pixels share, as in pictures that were filtered, resized or compressed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from pipelines.detection import circle_light
from pipelines.detection.board_map import grid
from pipelines.detection.circle import find_circle
from pipelines.detection.circle_numbers import OBLONG
from pipelines.detection.circle_scatter import SECTORS, confirmed, scatter_of_sectors
from tests.pipelines.detection import test_circle as drawing

NOISE, FILTER_PX = 4.0, 1.0  # grey values, and the blur of the noise
OF_CORNERS = 5.0  # factor by which corners of such pictures scatter: measured 3.7 to 5.3


def ring(numbers=10):
    """Pixels around a disc, and slopes of a fit's numbers, of which the first two move its rim."""
    y, x = np.mgrid[-14:15, -14:15]
    rows, columns = y.ravel(), x.ravel()
    far, turn = np.hypot(rows, columns), np.arctan2(rows, columns)
    rim = np.exp(-0.5 * (far - 10.0) ** 2)
    smooth = [np.cos(k * turn) * far**j / 10.0**j for k, j in ((0, 0), (1, 1), (0, 2), (2, 2), (3, 1), (2, 1), (0, 1))]
    return rows, columns, np.column_stack((rim * np.cos(turn), rim * np.sin(turn), rim, *smooth))[:, :numbers]


def draw(rng, usual, shared):
    """The factor, and the place's mean square in its stated variances.

    The noise has unit variance, and one number of `shared` deviations for all pixels of a sector's rim.
    """
    rows, columns, slopes = ring()
    turn = np.floor((np.arctan2(rows, columns) / np.pi + 1.0) * 0.5 * SECTORS).astype(int) % SECTORS
    noise = rng.standard_normal(len(rows)) + shared * rng.standard_normal(SECTORS)[turn] * slopes[:, 2]
    inverse = np.linalg.inv(slopes.T @ slopes)
    numbers = inverse @ (slopes.T @ noise)
    factor = scatter_of_sectors(
        SimpleNamespace(rows=rows, columns=columns), slopes, noise - slopes @ numbers, inverse, 1.0, usual
    )
    return factor, numbers[:2] @ np.linalg.solve(inverse[:2, :2], numbers[:2]) / 2.0


@pytest.mark.parametrize("shared", [0.0, 0.5, 1.0])
def test_the_factor_is_that_of_the_places_variance(shared):
    """If the corners say so, too. Mean squares of 400 places, of two numbers each, scatter by a twentieth."""
    rng = np.random.default_rng(0)
    usual = np.mean([draw(rng, 1.0, shared)[1] for _ in range(400)])
    factor = np.mean([draw(rng, max(usual, 1.0), shared)[0] for _ in range(200)])
    assert 0.8 < factor / usual < 1.2


def test_corners_that_scatter_count_as_far_as_the_circle_shows_it():
    assert [confirmed(5.0, 0.4), confirmed(5.0, 3.0), confirmed(5.0, 7.0), confirmed(1.0, 7.0)] == [1.0, 3.0, 5.0, 1.0]


def filtered(image, rng, noise):
    """8 bits with noise of neighbours that resemble each other."""
    grain = gaussian_filter(rng.standard_normal(image.shape), FILTER_PX)
    return np.clip(np.rint(image + noise * grain / grain.std()), 0.0, 255.0).astype(np.uint8)


def test_corners_that_scatter_widen_what_is_stated():
    """Measured 2.06 times the area squared."""
    image, camera = drawing.board_with("far")
    picture = filtered(image, np.random.default_rng(1), NOISE)  # in which neither frees the circle's form
    plain = drawing.exact_corners(picture, camera)
    one, other = (
        find_circle(picture, replace(plain, scatter=s), grid(drawing.TARGET.inner), drawing.TARGET)
        for s in (1.0, OF_CORNERS)
    )
    assert np.linalg.det(other.covariance_px2) > 1.5 * np.linalg.det(one.covariance_px2)
    assert np.allclose(one.centre_px, other.centre_px, atol=1e-3)


def test_filtered_noise_is_not_taken_for_an_oblong_print(monkeypatch):
    """It is in 3 of these 12 pictures if their noise counts as independent."""
    freed = []
    image, camera = drawing.board_with("far")
    plain = circle_light._with_spread

    def counted(known, which, value):
        freed.append(which == OBLONG)
        return plain(known, which, value)

    monkeypatch.setattr(circle_light, "_with_spread", counted)
    rng = np.random.default_rng(3)
    for _ in range(12):
        picture = filtered(image, rng, 2.0 * NOISE)
        corners = replace(drawing.exact_corners(picture, camera), scatter=OF_CORNERS)
        find_circle(picture, corners, grid(drawing.TARGET.inner), drawing.TARGET)
    assert not any(freed)
