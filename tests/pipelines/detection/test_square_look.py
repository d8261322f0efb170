"""What white squares hold, from how dark their places are."""

import numpy as np
import pytest

from pipelines.detection.square_look import DISC, PLACES, _classified

U, V = PLACES.T
RADIUS = 0.3  # squares


@pytest.mark.parametrize("depth", [0.63, 1.0])  # of a shadow, as white nearby has it
def test_the_edge_of_a_shadow_is_no_disc(depth):
    turns, places = np.arange(0.0, 2.0 * np.pi, 0.2), np.linspace(-0.4, 0.4, 17)
    away = np.array([np.cos(a) * U + np.sin(a) * V - p for a in turns for p in places])
    assert not np.any(_classified(depth * (away > 0.0), RADIUS) == DISC)
    assert not np.any(_classified(depth * (np.abs(away) < 0.15), RADIUS) == DISC)


@pytest.mark.parametrize("soft", [0.02, 0.3])  # squares from light to dark
def test_a_disc_is_one_wherever_it_stands_in_its_square(soft):
    """It stands above the board: a slanted view moves it."""
    x, y = (part.ravel() for part in np.meshgrid(*2 * [np.linspace(-0.2, 0.2, 9)]))
    dark = np.clip(0.5 + (RADIUS - np.hypot(U - x[:, None], V - y[:, None])) / soft, 0.0, 1.0)
    assert np.all(_classified(dark, RADIUS) == DISC)
