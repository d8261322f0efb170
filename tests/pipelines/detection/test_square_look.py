"""What white squares hold, from how dark their places are."""

import numpy as np
import pytest

from pipelines.detection.square_look import CLEAR, DISC, PLACES, UNEVEN, UNKNOWN, _classified, _found_in_shadows

U, V = PLACES.T
RADIUS = 0.3  # squares


@pytest.mark.parametrize("depth", [0.63, 1.0])  # of a shadow, as white nearby has it
def test_the_edge_of_a_shadow_is_no_disc(depth):
    turns, places = np.arange(0.0, 2.0 * np.pi, 0.2), np.linspace(-0.4, 0.4, 17)
    away = np.array([np.cos(a) * U + np.sin(a) * V - p for a in turns for p in places])
    assert not np.any(_classified(depth * (away > 0.0), RADIUS, UNEVEN) == DISC)
    assert not np.any(_classified(depth * (np.abs(away) < 0.15), RADIUS, UNEVEN) == DISC)


@pytest.mark.parametrize("soft", [0.02, 0.3])  # squares from light to dark
def test_a_disc_is_one_wherever_it_stands_in_its_square(soft):
    """It stands above the board: a slanted view moves it."""
    x, y = (part.ravel() for part in np.meshgrid(*2 * [np.linspace(-0.2, 0.2, 9)]))
    dark = np.clip(0.5 + (RADIUS - np.hypot(U - x[:, None], V - y[:, None])) / soft, 0.0, 1.0)
    assert np.all(_classified(dark, RADIUS, UNEVEN) == DISC)


def in_stripes(depth, squares=30):
    """Darkness (squares, m) of white squares in stripes of shadow so dark; the first has a disc."""
    away = np.array([U + 0.4 * V - p for p in np.linspace(-0.4, 0.4, squares)])
    dark = np.where(away % 0.4 < 0.2, depth, 0.0)
    dark[0, np.hypot(U, V) < RADIUS] = 1.0
    return dark


@pytest.mark.parametrize(("depth", "is_found"), [(0.5, True), (0.7, True), (0.95, False)])
def test_a_disc_that_shadows_hide_is_found_where_they_are_less_dark(depth, is_found):
    dark = in_stripes(depth)
    plain = _classified(dark, RADIUS, UNEVEN)
    assert plain[0] == UNKNOWN
    found = _found_in_shadows(plain, dark, RADIUS)
    assert (found[0] == DISC) == is_found
    assert np.array_equal(found[1:], plain[1:])


def test_two_such_discs_are_none():
    dark = in_stripes(0.6)
    dark[1] = dark[0]
    plain = np.full(len(dark), UNKNOWN)
    assert not np.any(_found_in_shadows(plain, dark, RADIUS) == DISC)
    plain[:] = CLEAR  # what is seen without shadows stands
    assert np.all(_found_in_shadows(plain, in_stripes(0.6), RADIUS) == CLEAR)
